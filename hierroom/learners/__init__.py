"""One learner for any agent: recurrent PPO on the agent's own turns."""

from hierroom.learners.config import PPOConfig
from hierroom.learners.distillation import RandomDistillation
from hierroom.learners.modular import ModularActorCritic
from hierroom.learners.networks import AgentSpace, PolicyNetwork, RecurrentActorCritic
from hierroom.learners.policy import Policy
from hierroom.learners.ppo import Learner

__all__ = [
    "AgentSpace",
    "Learner",
    "ModularActorCritic",
    "PPOConfig",
    "Policy",
    "PolicyNetwork",
    "RandomDistillation",
    "RecurrentActorCritic",
]
