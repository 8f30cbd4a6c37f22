"""The arrays of observations, rewards, ends and infos that the Gymnasium vector environment returns."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.controller import Observation
from hierroom.support.array_pool import ArrayPool
from hierroom.support.compile.kernel import compiled
from hierroom.turns.kernels import write_results
from hierroom.turns.records import CONTROLLER, LEDGER, STEP, Step
from hierroom.turns.turns import Turns
from hierroom.worlds.observation_writer import flat_rows

INFOS = ("success", "goal_event", "elapsed", "illegal_actions", "length", "shortest_length")
_BOOL, _INT64 = np.dtype(np.bool_), np.dtype(np.int64)
"""Made once: with a type instead of a dtype, numpy makes one for every array."""


class VectorArrays:
    """Writes observations, rewards, ends and infos of N environments, each once.

    With ``flat``, an environment's observation is one row of numbers. Arrays are new at every step; without ``copy``,
    the next step overwrites those of the observations.
    """

    def __init__(self, turns: Turns, *, flat: bool, copy: bool) -> None:
        self._turns, self._flat, self._n = turns, flat, len(turns)
        self.observations = turns.world.batch_observations(flat=flat)
        self._parts = turns.observation_space(CONTROLLER)
        self.space = self.observations.flat_space if flat else self._parts
        self._results = ArrayPool(self._empty_results)
        self._pool = ArrayPool(self.observations.empty)
        self._kept = None if copy else self.observations.empty()
        self._no_step = np.zeros(self._n, STEP)

    def _empty_results(self) -> tuple[tuple[NDArray, ...], dict[str, NDArray]]:
        """Return the arrays of `kernels.write_results`, then the rows of both matrices, and the infos by name.

        Each argument of a kernel takes time, so that it gets three arrays for fifteen.
        """
        flags, numbers = np.empty((3 + len(INFOS), self._n), _BOOL), np.empty((len(INFOS) - 1, self._n), _INT64)
        terminated, truncated, success, *has_infos = flags
        infos = _by_name((success, *numbers), has_infos)
        return (np.empty(self._n), flags, numbers, terminated, truncated, *infos.values()), infos

    def at_step(
        self, steps: np.ndarray, *, begins_anew: bool
    ) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Return observations after the meta-controller's turn, rewards, terminated, truncated and infos of a step.

        Args:
            steps: [N] records of what it did.
            begins_anew: whether infos are of the next episode where one ended.

        Returns:
            a dict of arrays, or one array [N, K] of rows, and what Gymnasium asks for besides.
        """
        results, infos = self._results.take()
        observations = self._write(steps, begins_anew, results)
        return observations, results[0], results[3], results[4], infos.copy()

    def at_reset(self, where: NDArray[np.bool_]) -> tuple[Any, dict[str, Any]]:
        """Return what the controller observes everywhere, and the infos of the environments whose episode begins."""
        results, _ = self._empty_results()
        observations = self._write(self._no_step, False, results)
        shortest = self._turns.ledger.shortest * where
        infos = np.zeros(self._n, _BOOL), -where.astype(_INT64), *np.zeros((3, self._n), _INT64), shortest
        return observations, _by_name(infos, [where.copy() for _ in INFOS])

    def _write(self, steps: np.ndarray, begins_anew: bool, results: tuple[NDArray, ...]) -> Any:
        """Write a step's results and new observations, and return the observations."""
        arrays, parts = self._kept or self._pool.take()
        _compiled_results()(steps, self._turns.ledger.records, begins_anew, results[0], results[1], results[2])
        self.observations.write(self._turns.ledger.goals, arrays)
        return arrays[0] if self._flat else parts.copy()

    def final(self, step: Step) -> dict[str, Any]:
        """Return the last observations and infos of the episodes that a step ended."""
        ended = step.episode_ended.copy()
        numbers = (step.events, step.meta_elapsed > 0, step.illegal_actions, step.lengths, step.shortest)
        infos = _by_name(
            (step.success & ended, *(values * ended.astype(_INT64) for values in numbers)),
            [ended.copy() for _ in INFOS],
        )
        observations, envs = np.full(self._n, None, object), np.flatnonzero(ended)
        last = self._turns.final_observation(CONTROLLER, step, envs)
        one_by_one = rows(last, self._parts if self._flat else None, self.space.dtype)
        for env, observation in zip(envs, one_by_one, strict=True):
            observations[env] = observation
        return {"final_obs": observations, "final_info": infos, "_final_obs": ended, "_final_info": ended.copy()}


def rows(observation: Observation, space: spaces.Dict | None, dtype: Any = np.float32) -> Iterable[Any]:
    """Return the observations of M environments one by one, in new arrays; flat where their space is given."""
    parts = observation.as_dict()
    if space is None:
        return (dict(zip(parts, of_one, strict=True)) for of_one in zip(*parts.values(), strict=True))
    return flat_rows(parts, space, dtype)


def _by_name(infos: Iterable[NDArray], has_infos: Iterable[NDArray[np.bool_]]) -> dict[str, NDArray]:
    """Return infos by name, with Gymnasium's entries that say which environments have them."""
    named = {}
    for name, values, has_info in zip(INFOS, infos, has_infos, strict=True):
        named[name], named[f"_{name}"] = values, has_info
    return named


@cache
def _compiled_results() -> Callable[..., None]:
    """Compile `kernels.write_results` for the types of a batch's arrays."""
    flags, numbers = np.zeros((1, 1), _BOOL), np.zeros((1, 1), _INT64)
    return compiled(write_results, np.zeros(1, STEP), np.zeros(1, LEDGER), True, np.zeros(1), flags, numbers)
