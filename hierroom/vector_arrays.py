"""The arrays in which the Gymnasium vector environment tells its users of N environments."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.controller import Observation
from hierroom.goals import GOAL_VECTORS, N_COLOURS
from hierroom.options import CONTROLLER, LEDGER
from hierroom.step import STEP, Step
from hierroom.turn_kernels import write_results
from hierroom.turns import Turns
from hierroom.world.kernels import compiled
from hierroom.world.layout import LEVEL, OUTCOME
from hierroom.world.observations import IMAGE, N_DIRECTIONS, N_NUMBERS, write_batch, write_flat
from hierroom.world.tiles import TRIPLES

_GOAL_SIZE = GOAL_VECTORS.shape[1]
_BOOL, _INT8, _UINT8 = np.dtype(np.bool_), np.dtype(np.int8), np.dtype(np.uint8)
_INT64, _FLOAT32 = np.dtype(np.int64), np.dtype(np.float32)
"""Made once: with a type instead of a dtype, numpy makes one for every array."""


class VectorArrays:
    """Writes observations, rewards, ends and infos of N environments, each once.

    Args:
        turns: the environments.
        flat: whether an environment's observation is one row of numbers; see `flat_space`.
        copy: whether arrays are new at every step; else the next step overwrites those of the observations.
    """

    def __init__(self, turns: Turns, *, flat: bool, copy: bool) -> None:
        self._turns, self._flat = turns, flat
        self.space = flat_space(turns.world.n_actions) if flat else turns.observation_space(CONTROLLER)
        self._n, n_actions = len(turns), turns.world.n_actions
        self._shape = (self._n, n_actions + N_NUMBERS) if flat else (self._n, *IMAGE)
        self._everywhere = np.ones((6, self._n), bool)
        self._masks = np.ones((self._n, n_actions), np.int8)
        self._kept = None if copy else self._empty()

    def _empty(self) -> tuple[NDArray, ...]:
        if self._flat:
            return (np.empty(self._shape, _UINT8),)
        n = self._n
        keys, doors = np.empty((2, n, N_COLOURS), _INT8)
        return (
            np.empty(self._shape, _UINT8),
            np.empty((n, _GOAL_SIZE), _FLOAT32),
            np.empty(n, _INT64),
            keys,
            doors,
        )

    def observations(self) -> Any:
        """What the controller observes everywhere: a dict of arrays, or one array [N, K] of rows."""
        arrays = self._kept or self._empty()
        world, ledger = self._turns.world, self._turns.ledger
        if self._flat:
            _compiled_flat()(
                world.outcomes, world.state.levels, ledger.records, TRIPLES, GOAL_VECTORS, world.n_actions, *arrays
            )
            return arrays[0]
        _compiled_batch()(world.outcomes, world.state.levels, ledger.records, TRIPLES, GOAL_VECTORS, *arrays)
        images, goals, directions, keys, doors = arrays
        return {
            "observation": images,
            "goal": goals,
            "direction": directions,
            "keys_held": keys,
            "doors_open": doors,
            "action_mask": self._masks if self._kept else self._masks.copy(),
        }

    def show_goals(self, observations: Any, goals: NDArray[np.integer], envs: NDArray[np.integer]) -> None:
        """Put the goals [N] of some environments into observations, where the ledger has them no more."""
        if self._flat:
            at = self._turns.world.n_actions + N_DIRECTIONS + N_COLOURS
            observations[envs, at : at + _GOAL_SIZE] = GOAL_VECTORS[goals[envs]]
        else:
            observations["goal"][envs] = GOAL_VECTORS[goals[envs]]

    def results(
        self, step: Step, *, begins_anew: bool
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """What came of a step: rewards, terminated, truncated and infos, in new arrays.

        Args:
            step: the step.
            begins_anew: whether infos tell of the next episode where one ended.
        """
        n = self._n
        rewards, flags, numbers = np.empty(n), np.empty((3, n), _BOOL), np.empty((5, n), _INT64)
        _compiled_results()(step.records, self._turns.ledger.records, begins_anew, rewards, flags, numbers)
        terminated, truncated, success = flags
        return rewards, terminated, truncated, _infos(success, numbers, self._everywhere.copy())

    def at_reset(self, where: NDArray[np.bool_]) -> dict[str, Any]:
        """The infos of the environments whose episode begins."""
        n, ledger = self._n, self._turns.ledger
        numbers = np.zeros((5, n), np.int64)
        numbers[0, where], numbers[4, where] = -1, ledger.shortest[where]
        masks = np.empty((6, n), bool)
        masks[:] = where
        return _infos(np.zeros(n, bool), numbers, masks)

    def final(self, step: Step) -> dict[str, Any]:
        """What infos say of the episodes that a step ended: their last observations, and their last infos."""
        n, ended = self._n, step.episode_ended.copy()
        *_, infos = self.results(step, begins_anew=False)
        infos = {name: values & ended if values.dtype == bool else values * ended for name, values in infos.items()}
        observations, envs = np.full(n, None, object), np.flatnonzero(ended)
        last = self._turns.final_observation(CONTROLLER, step, envs)
        for env, observation in zip(envs, rows(last, flat=self._flat), strict=True):
            observations[env] = observation
        return {
            "final_obs": observations,
            "final_info": infos,
            "_final_obs": ended,
            "_final_info": ended.copy(),
        }


def flat_space(n_actions: int) -> spaces.Box:
    """The space of a flat observation, for a controller with so many actions.

    Its numbers are those of the entries of `Observation.as_dict` in alphabetical order, directions one-hot, just as
    `gymnasium.spaces.flatten` orders them, but in uint8: ``action_mask`` [A], ``direction`` [4], ``doors_open`` [6],
    ``goal`` [9], ``keys_held`` [6], ``observation`` [7 * 7 * 3].
    """
    high = np.ones(n_actions + N_NUMBERS, np.uint8)
    high[-int(np.prod(IMAGE)) :] = 10
    return spaces.Box(np.zeros_like(high), high, dtype=np.uint8)


def rows(observation: Observation, *, flat: bool) -> Iterable[Any]:
    """The observations of M environments one by one, in new arrays."""
    parts = observation.as_dict()
    if not flat:
        return ({name: values[m] for name, values in parts.items()} for m in range(len(observation)))
    parts["direction"] = np.eye(N_DIRECTIONS)[parts["direction"]]
    numbers = [parts[name].reshape(len(observation), -1) for name in sorted(parts)]
    return np.concatenate(numbers, axis=1, dtype=np.uint8, casting="unsafe")


def _infos(success: NDArray[np.bool_], numbers: NDArray[np.int64], masks: NDArray[np.bool_]) -> dict[str, NDArray]:
    """Infos by name, with Gymnasium's entries that say which environments they tell of."""
    event, elapsed, illegal, length, shortest = numbers
    of_event, of_elapsed, of_illegal, of_success, of_length, of_shortest = masks
    return {
        "goal_event": event,
        "_goal_event": of_event,
        "elapsed": elapsed,
        "_elapsed": of_elapsed,
        "illegal_actions": illegal,
        "_illegal_actions": of_illegal,
        "success": success,
        "_success": of_success,
        "length": length,
        "_length": of_length,
        "shortest_length": shortest,
        "_shortest_length": of_shortest,
    }


_BATCH = np.zeros(1, OUTCOME), np.zeros(1, LEVEL), np.zeros(1, LEDGER), TRIPLES, GOAL_VECTORS


@cache
def _compiled_batch() -> Callable[..., None]:
    """Compile `observations.write_batch` for the types of a batch's arrays."""
    arrays = np.zeros((1, *IMAGE), np.uint8), np.zeros((1, 1), np.float32), np.zeros(1, np.int64)
    return compiled(write_batch, *_BATCH, *arrays, np.zeros((1, 1), np.int8), np.zeros((1, 1), np.int8))


@cache
def _compiled_flat() -> Callable[..., None]:
    """Compile `observations.write_flat`, likewise."""
    return compiled(write_flat, *_BATCH, 1, np.zeros((1, 1), np.uint8))


@cache
def _compiled_results() -> Callable[..., None]:
    """Compile `turn_kernels.write_results`, likewise."""
    records = np.zeros(1, STEP), np.zeros(1, LEDGER)
    return compiled(write_results, *records, True, np.zeros(1), np.zeros((1, 1), bool), np.zeros((1, 1), np.int64))
