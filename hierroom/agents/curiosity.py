"""Curiosity: a reward for novel observations of the controller."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.agents.features import Features
from hierroom.controller import Observation
from hierroom.learners.distillation import RandomNetworkDistillation
from hierroom.support.errors import InputError


class Curiosity(RandomNetworkDistillation):
    """Random network distillation on the controller's observations of the world, without goals and past actions.

    Args:
        features: the controller's features.
        weight: weight of curiosity in the reward; an EscapeRoom's exit gives 1.
        **settings: the other arguments of `RandomNetworkDistillation`.
    """

    STATISTICS: Sequence[str] = ("curiosity_error",)

    def __init__(self, features: Features, num_envs: int, weight: float, **settings: Any) -> None:
        names = features.subset(of_world=True)
        if not names:
            raise InputError(f"curiosity needs features of the level; {', '.join(features.names)} has none")
        self.features, self._weight = Features(features.world, names), weight
        if self.features.arrays:
            raise InputError("the curiosity of ppo-rnd reads categories; the task's observations hold arrays: take ppo")
        super().__init__(self.features.cardinalities, num_envs, **settings)

    def weighted(self, observation: Observation) -> NDArray[np.float64]:
        """Return the rewards [N] for a step, given the observation after it and before any reset."""
        return self._weight * self.rewards(self.features.encode(observation))
