"""A user's environment that also says, after each step, how it stands with the goals."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import InputError, raise_told, shown

GoalFunction = Callable[[Any, dict[str, Any]], Any]
"""From the environment and the info of its last step to whether a goal is achieved, or how often it has been."""
COUNTS = "hierroom_goals"
"""The entry of the info that holds the counts."""


class GoalEnv(gymnasium.Wrapper):
    """An environment that puts the counts [G] of its goals into the info, 0 or 1 for a goal that is true or false.

    Args:
        env: the user's environment.
        goals: a function for each goal.
        name: of the task, for errors.
    """

    def __init__(self, env: gymnasium.Env, goals: Mapping[str, GoalFunction], name: str) -> None:
        super().__init__(env)
        self._goals, self._name = goals, name

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        try:
            observation, info = self.env.reset(seed=seed, options=options)
        except Exception as error:  # whatever a user's own code may raise
            raise_told(f"reset of {self._name}", error)
        return observation, {**info, COUNTS: self._counts(info)}

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Take a step."""
        try:
            observation, reward, terminated, truncated, info = self.env.step(action)
        except Exception as error:  # whatever a user's own code may raise
            raise_told(f"step of {self._name}", error)
        return observation, reward, bool(terminated), bool(truncated), {**info, COUNTS: self._counts(info)}

    def _counts(self, info: dict[str, Any]) -> NDArray[np.int64]:
        counts = np.empty(len(self._goals), np.int64)
        for n, (name, function) in enumerate(self._goals.items()):
            try:
                value = function(self.env, info)
            except (Exception, SystemExit) as error:  # whatever a user's own code may raise
                raise_told(f"goal {name!r} of {self._name}", error)
            if not isinstance(value, (bool, int, np.bool_, np.integer)) or value < 0:
                rule = "must return True, False or a count of at least 0"
                raise InputError(f"goal {name!r} of {self._name} {rule}, not {shown(value)}")
            counts[n] = value
        return counts

    def are_counts(self, info: dict[str, Any]) -> list[bool]:
        """Return [G] whether each goal is a count that grows, rather than true or false."""
        values = [function(self.env, info) for function in self._goals.values()]
        return [not isinstance(value, (bool, np.bool_)) for value in values]
