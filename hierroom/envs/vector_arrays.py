"""The arrays of observations, rewards, ends and infos that the Gymnasium vector environment returns."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.support.arrays import ArrayPool
from hierroom.support.kernel import Compiled
from hierroom.turns.kernels import write_results
from hierroom.turns.records import CONTROLLER, LEDGER, STEP, Step
from hierroom.turns.turns import Turns

INFOS = ("success", "goal_event", "elapsed", "illegal_actions", "length", "shortest_length")
_BOOL, _INT64 = np.dtype(np.bool_), np.dtype(np.int64)
"""Made once, because numpy would make a new dtype from a type for every array."""


class VectorArrays:
    """Writes the observations, rewards, ends and infos of N environments.

    Arrays are new at every step. Without ``copy``, however, the next step overwrites the arrays of the observations.
    """

    def __init__(self, turns: Turns, *, copy: bool) -> None:
        self._turns, self._n = turns, len(turns)
        self._observations = turns.world.batch_observations()
        self._pool = ArrayPool(self._empty)
        self._kept = None if copy else self._observations.empty()

    def _empty(self) -> tuple[tuple[NDArray, ...], tuple[Any, ...]]:
        """Return all arrays that are new at every step, and the arrays in the form that `at_step` uses.

        Flags and integers are rows of two arrays, because each extra argument of the kernel takes time.
        """
        parts = self._kept or self._observations.empty()
        flags, numbers = np.empty((3 + len(INFOS), self._n), _BOOL), np.empty((len(INFOS) - 1, self._n), _INT64)
        terminated, truncated, success, *has_infos = flags
        infos = _by_name((success, *numbers), has_infos)
        results = np.empty(self._n), flags, numbers
        fresh = (*results, terminated, truncated, *infos.values())
        return fresh if self._kept else (*parts.values(), *fresh), (parts, results, terminated, truncated, infos)

    def at_step(
        self, steps: np.ndarray, *, begins_anew: bool
    ) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Return observations after the meta-controller's turn, rewards, terminated, truncated and infos of a step.

        Args:
            steps: [N] records of the step.
            begins_anew: whether the infos of ended episodes are replaced by those of the next episodes.

        Returns:
            a dict of arrays, and the other results of Gymnasium's step.
        """
        _, (parts, results, terminated, truncated, infos) = self._pool.take()
        _RESULTS.run(steps, self._turns.ledger.records, begins_anew, *results)
        return self._observe(parts), results[0], terminated, truncated, infos.copy()

    def at_reset(self, where: NDArray[np.bool_]) -> tuple[Any, dict[str, Any]]:
        """Return all controllers' observations, and infos of the environments that begin episodes: ``where`` [N]."""
        shortest = self._turns.ledger.shortest * where
        infos = np.zeros(self._n, _BOOL), -where.astype(_INT64), *np.zeros((3, self._n), _INT64), shortest
        observations = self._observe(self._kept or self._observations.empty())
        return observations, _by_name(infos, [where.copy() for _ in INFOS])

    def _observe(self, parts: dict[str, NDArray]) -> dict[str, NDArray]:
        self._observations.write(self._turns.ledger.goals, parts.values())
        return parts.copy()

    def final(self, step: Step) -> dict[str, Any]:
        """Return the last observations and infos of the episodes that a step ended."""
        ended = step.episode_ended.copy()
        numbers = (step.events, step.elapsed, step.illegal_actions, step.lengths, step.shortest)
        infos = _by_name(
            (step.success & ended, *(values * ended.astype(_INT64) for values in numbers)),
            [ended.copy() for _ in INFOS],
        )
        observations, envs = np.full(self._n, None, object), np.flatnonzero(ended)
        last = self._turns.final_observation(CONTROLLER, step, envs).as_dict()
        for env, *of_one in zip(envs, *last.values(), strict=True):
            observations[env] = dict(zip(last, of_one, strict=True))
        return {"final_obs": observations, "final_info": infos, "_final_obs": ended, "_final_info": ended.copy()}


def _by_name(infos: Iterable[NDArray], has_infos: Iterable[NDArray[np.bool_]]) -> dict[str, NDArray]:
    """Return infos by name, with Gymnasium's ``_name`` entries that say which environments have them."""
    named = {}
    for name, values, has_info in zip(INFOS, infos, has_infos, strict=True):
        named[name], named[f"_{name}"] = values, has_info
    return named


_FLAGS, _NUMBERS = np.zeros((1, 1), _BOOL), np.zeros((1, 1), _INT64)
_RESULTS = Compiled(write_results, np.zeros(1, STEP), np.zeros(1, LEDGER), True, np.zeros(1), _FLAGS, _NUMBERS)
