"""EscapeRoom environments, exploration complexity and hierarchical PPO for goal-driven navigation."""

from hierroom import complexity
from hierroom.aec_env import env, raw_env
from hierroom.box_view import box_view
from hierroom.errors import InputError
from hierroom.goals import GoalGraph, enumerate_graphs
from hierroom.gym_env import register_envs
from hierroom.parallel_env import parallel_env

__all__ = [
    "GoalGraph",
    "InputError",
    "box_view",
    "complexity",
    "enumerate_graphs",
    "env",
    "parallel_env",
    "raw_env",
]
__version__ = "0.1.0"

register_envs()
