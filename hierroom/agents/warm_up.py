"""Warm-up: a meta-controller chooses goals at random until its controller reaches the target in some episodes."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from hierroom.meta import random_choice
from hierroom.support.schema import Flag, Items, Table
from hierroom.turns.records import Step
from hierroom.turns.situation import Situation

WINDOW = 100
"""Number of last episodes over which success is measured to end the warm-up."""


class WarmUp:
    """Chooses legal goals at random, preferring those seen this episode, until enough episodes reach the target.

    At first the controller reaches no goal, so an option's reward says nothing about its goal. The warm-up ends
    (``has_ended``) when a share ``start_success`` of the last `WINDOW` episodes has reached the target.
    """

    def __init__(self, start_success: float) -> None:
        self.has_ended = start_success == 0
        self._start_success = start_success
        self._successes: deque[bool] = deque(maxlen=WINDOW)

    def choose(self, situation: Situation) -> NDArray[np.integer]:
        """Return goal ids [M]; G or -1 is no goal."""
        likely = situation.masks.copy()
        likely[:, :-1] &= situation.seen
        is_any = likely.any(axis=1, keepdims=True)
        return random_choice(np.where(is_any, likely, situation.masks), situation.uniforms)

    def add(self, step: Step) -> None:
        """Count the episodes that a step ended."""
        self._successes.extend(step.success[step.episode_ended].tolist())
        rate = sum(self._successes) / WINDOW
        self.has_ended = len(self._successes) == WINDOW and rate >= self._start_success

    def state_dict(self) -> dict:
        """Return the complete state, as plain types."""
        return {"has_ended": self.has_ended, "successes": list(self._successes)}

    def load_state_dict(self, state: dict) -> None:
        """Restore what `state_dict` returned."""
        Table({"has_ended": Flag(), "successes": Items(Flag(), 0, WINDOW)}).check(state, "warm_up")
        self.has_ended, self._successes = state["has_ended"], deque(state["successes"], WINDOW)
