"""The parallel environment with flat, equal spaces for both agents, for libraries that take no dicts, as SuperSuit.

| part | numbers | padded |
|---|---|---|
| ``observation`` / 10 | 147 | |
| ``goal`` | 9 | |
| ``direction``, one-hot | 4 | |
| ``keys_held`` | 6 | |
| ``doors_open`` | 6 | |
| ``outcome``, one-hot | 4 | all zero for ``controller_0`` |
| ``action_mask`` | 14 | zero for the actions that ``controller_0`` does not have |
| whose it is | 1 | 1 for ``meta_0``, 0 for ``controller_0`` |

Both agents have 14 actions. Those that ``controller_0`` does not have only cost the step.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from pettingzoo import ParallelEnv
from pettingzoo.utils import BaseParallelWrapper

from hierroom.goals import GOAL_VECTORS, N_COLOURS
from hierroom.options import META, N_OUTCOMES
from hierroom.turns import N_META_ACTIONS
from hierroom.world.kernels import VIEW

SIZES = {
    "observation": VIEW * VIEW * 3,
    "goal": GOAL_VECTORS.shape[1],
    "direction": 4,
    "keys_held": N_COLOURS,
    "doors_open": N_COLOURS,
    "outcome": N_OUTCOMES,
    "action_mask": N_META_ACTIONS,
    "is_meta": 1,
}
"""Numbers of each part, in order."""
SIZE = sum(SIZES.values())


class box_view(BaseParallelWrapper):
    """A parallel environment whose agents both have one Box to see and one Discrete to act in.

    Args:
        env: a `hierroom.parallel_env`.
    """

    def __init__(self, env: ParallelEnv):
        super().__init__(env)
        self.possible_agents = env.possible_agents
        self._actions = {agent: spaces.Discrete(N_META_ACTIONS) for agent in env.possible_agents}
        self._spaces = {agent: spaces.Box(0, 1, (SIZE,), np.float32) for agent in env.possible_agents}

    def observation_space(self, agent: str) -> spaces.Space:
        """The observation space of an agent: the same object at every call."""
        return self._spaces[agent]

    def action_space(self, agent: str) -> spaces.Space:
        """The action space of an agent: the same object at every call."""
        return self._actions[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None):
        """As the environment's, observations flat."""
        observations, infos = self.env.reset(seed, options)
        return _flat(observations), infos

    def step(self, actions: dict[str, int]):
        """As the environment's, observations flat."""
        observations, *results = self.env.step(actions)
        return _flat(observations), *results


def _flat(observations: dict[str, dict[str, Any]]) -> dict[str, NDArray[np.float32]]:
    return {agent: _vector(agent, observation) for agent, observation in observations.items()}


def _vector(agent: str, observation: dict[str, Any]) -> NDArray[np.float32]:
    """One observation as [192] numbers from 0 to 1."""
    parts = {
        **observation,
        "observation": observation["observation"] / np.float32(10),
        "direction": np.eye(SIZES["direction"])[observation["direction"]],
        "outcome": np.eye(N_OUTCOMES)[observation["outcome"]] if agent == META else (),
        "is_meta": (agent == META,),
    }
    vector = np.zeros(SIZE, np.float32)
    start = 0
    for name, size in SIZES.items():
        part = np.ravel(parts[name])
        vector[start : start + len(part)] = part
        start += size
    return vector
