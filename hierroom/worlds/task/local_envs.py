"""N environments of a task in this process."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierroom.support.env_results import reset_results, step_results
from hierroom.support.errors import InputError, user_code
from hierroom.worlds.task.goal_values import as_totals, goal_values
from hierroom.worlds.task.parts import TaskParts
from hierroom.worlds.task.picture import as_picture
from hierroom.worlds.window import without_window


class Taken(NamedTuple):
    """The results of a step in M environments, with one item for each."""

    observations: Sequence[Any]
    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    totals: NDArray  # [M, G] values of the goals


class LocalEnvs:
    """N environments that are stepped one after the other, ``envs``, as the task's ``make`` returned them."""

    def __init__(self, task: TaskParts, num_envs: int, render_mode: str | None = None) -> None:
        self._name, self._goals = task.name, task.goals
        self.envs = [task.new_env(render_mode) for _ in range(num_envs)]

    def reset(self, envs: Sequence[int], seeds: Sequence[int]) -> tuple[Sequence[Any], NDArray]:
        """Begin an episode in some environments; return their observations and goal values [M, G]."""
        chosen = [self.envs[number] for number in envs]
        with user_code(f"reset of {self._name}"):
            results = [env.reset(seed=seed) for env, seed in zip(chosen, seeds, strict=True)]
            observations, infos = reset_results(results, self._name)
            values = goal_values(self._goals, chosen, infos, self._name)
        return observations, as_totals(values, self._goals, self._name)

    def step(self, envs: Sequence[int], actions: Sequence[int]) -> Taken:
        """Act in some environments, at least one."""
        chosen = [self.envs[number] for number in envs]
        with user_code(f"step of {self._name}"):
            results = [env.step(action) for env, action in zip(chosen, actions, strict=True)]
            observations, rewards, terminated, truncated, infos = step_results(results, self._name)
            values = goal_values(self._goals, chosen, infos, self._name)
        totals = as_totals(values, self._goals, self._name)
        return Taken(observations, rewards, terminated, truncated, totals)

    def render(self, env: int) -> NDArray[np.uint8]:
        """Return an environment's picture [H, W, 3]."""
        with user_code("the environment", "cannot be drawn"), without_window():
            return as_picture(self.envs[env].render())

    def close(self) -> InputError | None:
        """Close all environments, and return the last error."""
        failure = None
        for env in self.envs:
            try:
                with user_code(f"close of {self._name}"):
                    env.close()
            except InputError as error:
                failure = error
        return failure
