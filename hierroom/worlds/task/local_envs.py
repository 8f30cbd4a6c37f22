"""N environments of a task in this process."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import InputError, user_code
from hierroom.worlds.task.goal_values import as_totals, goal_values
from hierroom.worlds.task.parts import TaskParts


class Taken(NamedTuple):
    """The results of a step in M environments, with one item for each."""

    observations: list[Any]
    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    totals: NDArray  # [M, G] values of the goals


class LocalEnvs:
    """N environments that are stepped one after the other, ``envs``, as the task's ``make`` returned them."""

    def __init__(self, task: TaskParts, num_envs: int, render_mode: str | None = None) -> None:
        self._name, self._goals = task.name, task.goals
        self.envs = [task.new_env(render_mode) for _ in range(num_envs)]

    def reset(self, envs: Sequence[int], seeds: Sequence[int]) -> tuple[list[Any], NDArray]:
        """Begin an episode in some environments; return their observations and goal values [M, G]."""
        observations, infos, chosen = [], [], [self.envs[number] for number in envs]
        with user_code(f"reset of {self._name}"):
            for env, seed in zip(chosen, seeds, strict=True):
                observation, info = env.reset(seed=seed)
                observations.append(observation)
                infos.append(info)
            values = goal_values(self._goals, chosen, infos, self._name)
        return observations, as_totals(values, self._goals, self._name)

    def step(self, envs: Sequence[int], actions: Sequence[int]) -> Taken:
        """Act in some environments, at least one."""
        chosen = [self.envs[number] for number in envs]
        with user_code(f"step of {self._name}"):
            results = [env.step(action) for env, action in zip(chosen, actions, strict=True)]
            observations, rewards, terminated, truncated, infos = map(list, zip(*results, strict=True))
            values = goal_values(self._goals, chosen, infos, self._name)
        results = self._as_arrays(rewards, terminated, truncated)
        return Taken(observations, *results, as_totals(values, self._goals, self._name))

    def _as_arrays(
        self, rewards: list[Any], terminated: list[Any], truncated: list[Any]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]:
        try:
            paid, ends, cuts = np.array(rewards, np.float64), np.array(terminated, bool), np.array(truncated, bool)
            if not paid.ndim == ends.ndim == cuts.ndim == 1:
                raise ValueError("an array in place of one of them")
        except (TypeError, ValueError, OverflowError) as error:
            raise InputError(f"{self._name} must return numbers and truths from a step: {error}") from error
        if not np.isfinite(paid).all():
            raise InputError(f"{self._name} gives a reward that is not finite")
        return paid, ends, cuts

    def render(self, env: int) -> Any:
        """Return an environment's picture or text."""
        with user_code("the environment", "cannot be drawn"):
            return self.envs[env].render()

    def close(self) -> None:
        """Close all environments."""
        with user_code(f"close of {self._name}"):
            for env in self.envs:
                env.close()
