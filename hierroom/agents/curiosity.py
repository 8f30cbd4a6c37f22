"""Curiosity: a reward for novel observations of the controller."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hierroom.agents.features import Features
from hierroom.controller import Observation
from hierroom.learners.distillation import RandomNetworkDistillation
from hierroom.support.errors import InputError


class Curiosity:
    """Random network distillation on the controller's observations of the world, without goals and past actions.

    Args:
        features: the controller's features.
        weight: weight of curiosity in the reward; an EscapeRoom's exit gives 1.
        gamma: discount of the curiosity's returns.
        seed: seed of weights and minibatches.
    """

    STATISTICS: Sequence[str] = ("curiosity_error",)

    def __init__(
        self, features: Features, num_envs: int, weight: float, *, gamma: float, seed: int, device: str
    ) -> None:
        names = features.subset(of_world=True)
        if not names:
            raise InputError(f"curiosity needs features of the level; {', '.join(features.names)} has none")
        self.features = Features(features.world, names)
        if self.features.arrays:
            raise InputError("the curiosity of ppo-rnd reads categories; the task's observations hold arrays: take ppo")
        self._weight = weight
        self._distillation = RandomNetworkDistillation(
            self.features.cardinalities, num_envs, gamma=gamma, seed=seed, device=device
        )

    def rewards(self, observation: Observation) -> NDArray[np.float64]:
        """Return the rewards [N] for a step, given the observation after it and before any reset."""
        return self._weight * self._distillation.rewards(self.features.encode(observation))

    def learn(self) -> dict[str, float]:
        """Learn from the observations since the last call, and return `STATISTICS` by name."""
        return self._distillation.learn()

    def state_dict(self) -> dict:
        """Return the complete state, as tensors and plain types."""
        return self._distillation.state_dict()

    def load_state_dict(self, state: dict) -> None:
        """Restore what `state_dict` returned."""
        self._distillation.load_state_dict(state)
