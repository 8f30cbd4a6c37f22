"""A trial of a task: a few random steps in one environment."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from hierroom.support.errors import InputError, user_code
from hierroom.worlds.task.goal_values import goal_values
from hierroom.worlds.task.local_envs import LocalEnvs
from hierroom.worlds.task.parts import TaskParts, Trial
from hierroom.worlds.task.spaces import flat_entries

N_STEPS = 20


def try_out(task: TaskParts) -> Trial:
    """Take random steps in a new environment of a task, and raise its errors as one line."""
    env = task.new_env()
    actions = env.action_space
    if not isinstance(actions, spaces.Discrete):
        raise InputError(f"the actions of {task.name} must be Discrete, not {actions}; wrap its environment")
    entries, left_out = flat_entries(env.observation_space)
    with user_code(f"reset of {task.name}"):
        _, info = env.reset(seed=0)
    values = goal_values(task.goals, [env], [info], task.name)
    env.close()
    envs, random = LocalEnvs(task, 1), np.random.default_rng(0)
    envs.reset([0], [0])
    for _ in range(N_STEPS):
        taken = envs.step([0], [int(actions.start + random.integers(actions.n))])
        if taken.terminated[0] or taken.truncated[0]:
            envs.reset([0], [0])
    envs.close()
    are_counts = tuple(not isinstance(value, (bool, np.bool_)) for value in values)
    return Trial(entries, left_out, int(actions.n), int(actions.start), are_counts)
