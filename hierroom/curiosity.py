"""Curiosity: what the controller is paid, besides, for what is new to it of its rooms."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hierroom.errors import InputError
from hierroom.inputs import GOAL_INPUTS, InputColumns
from hierroom.learners import RandomDistillation
from hierroom.presets import TrainConfig
from hierroom.step import Step
from hierroom.turns import Turns

NOT_OF_THE_ROOM = (*GOAL_INPUTS, "doorway-places", "frontier-places", "previous-action")


class Curiosity:
    """Random network distillation of what the controller sees of its rooms: no goals, nothing of what it did.

    Args:
        config: what is trained.
        n_actions: the controller's actions.

    Raises:
        InputError: if the weight is negative or not a number, or the config's inputs show nothing of the room.
    """

    def __init__(self, config: TrainConfig, n_actions: int) -> None:
        if not 0 <= config.curiosity_weight < math.inf:
            raise InputError(f"curiosity_weight must be a number of at least 0, not {config.curiosity_weight}")
        self.inputs = InputColumns([name for name in config.inputs if name not in NOT_OF_THE_ROOM], n_actions)
        self._weight = config.curiosity_weight
        self._distillation = RandomDistillation(
            self.inputs.cardinalities, config.rooms, gamma=config.ppo.gamma, seed=config.seed, device=config.device
        )

    def rewards(self, step: Step, turns: Turns) -> NDArray[np.float64]:
        """[N] what is paid for a step just taken: where it ended the episode, for the last sight of that one."""
        codes, ended = self.inputs.codes(turns.sight()), np.flatnonzero(step.over)
        if len(ended):
            codes[ended] = self.inputs.codes(turns.final_sight(step, ended))
        return self._weight * self._distillation.rewards(codes)

    def learn(self) -> dict[str, float]:
        """Get used to what was seen since the last call; returns statistics."""
        return self._distillation.learn()

    def state_dict(self) -> dict:
        """Everything that decides what happens next, as tensors and plain types."""
        return self._distillation.state_dict()

    def load_state_dict(self, state: dict) -> None:
        """Restore what `state_dict` gave."""
        self._distillation.load_state_dict(state)
