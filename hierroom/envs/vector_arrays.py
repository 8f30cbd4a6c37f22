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
from hierroom.support.array_pool import ArrayPool
from hierroom.support.compile.kernel import compiled, njit
from hierroom.turns.kernels import write_results
from hierroom.turns.ledger import CONTROLLER, LEDGER
from hierroom.turns.records import STEP, Step
from hierroom.turns.turns import Turns
from hierroom.worlds.escape_room.layout import LEVEL, OUTCOME
from hierroom.worlds.escape_room.observations import IMAGE, N_DIRECTIONS, N_NUMBERS, write_batch, write_flat
from hierroom.worlds.escape_room.tiles import TRIPLES

INFOS = ("success", "goal_event", "elapsed", "illegal_actions", "length", "shortest_length")
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
        self._turns, self._flat, self._n = turns, flat, len(turns)
        self.space = flat_space(turns.world.n_actions) if flat else turns.observation_space(CONTROLLER)
        self._results = ArrayPool(self._empty_results)
        self._observations = ArrayPool(self._empty_observations)
        self._kept = None if copy else self._empty_observations()
        self._no_step = np.zeros(self._n, STEP)

    def _empty_results(self) -> tuple[tuple[NDArray, ...], dict[str, NDArray]]:
        """Arrays of rewards, ends and infos, and of which environments infos tell."""
        n = self._n
        rewards, terminated, truncated = np.empty(n), np.empty(n, _BOOL), np.empty(n, _BOOL)
        infos = np.empty(n, _BOOL), *(np.empty(n, _INT64) for _ in INFOS[1:])
        return (rewards, terminated, truncated, *infos, np.ones(n, _BOOL)), {}

    def _empty_observations(self) -> tuple[tuple[NDArray, ...], dict[str, NDArray]]:
        """Arrays of observations, and where they are several those by name."""
        n, n_actions = self._n, self._turns.world.n_actions
        if self._flat:
            return (np.empty((n, n_actions + N_NUMBERS), _UINT8),), {}
        parts = {
            "observation": np.empty((n, *IMAGE), _UINT8),
            "goal": np.empty((n, _GOAL_SIZE), _FLOAT32),
            "direction": np.empty(n, _INT64),
            "keys_held": np.empty((n, N_COLOURS), _INT8),
            "doors_open": np.empty((n, N_COLOURS), _INT8),
            "action_mask": np.empty((n, n_actions), _INT8),
        }
        return tuple(parts.values()), parts

    def at_step(
        self, step: Step, *, begins_anew: bool
    ) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """What came of a step, and what the controller observes now, after the meta-controller's turn.

        Args:
            step: the step.
            begins_anew: whether infos tell of the next episode where one ended.

        Returns:
            observations (a dict of arrays, or one array [N, K] of rows), rewards, terminated, truncated, infos.
        """
        results, _ = self._results.take()
        observations = self._write(step.records, begins_anew, results)
        rewards, terminated, truncated, *infos, told = results
        return observations, rewards, terminated, truncated, _by_name(infos, told)

    def at_reset(self, where: NDArray[np.bool_]) -> tuple[Any, dict[str, Any]]:
        """What the controller observes everywhere, and the infos of the environments whose episode begins."""
        results, _ = self._empty_results()
        observations = self._write(self._no_step, False, results)
        shortest = self._turns.ledger.shortest * where
        infos = np.zeros(self._n, _BOOL), -where.astype(_INT64), *np.zeros((3, self._n), _INT64), shortest
        return observations, _by_name(infos, where.copy())

    def _write(self, steps: np.ndarray, begins_anew: bool, results: tuple[NDArray, ...]) -> Any:
        """Write a step's results, and new observations, which it returns."""
        arrays, parts = self._kept or self._observations.take()
        world, ledgers = self._turns.world, self._turns.ledger.records
        write = _compiled_flat() if self._flat else _compiled_batch()
        write(world.outcomes, world.state.levels, steps, ledgers, begins_anew, *results, TRIPLES, GOAL_VECTORS, *arrays)
        return arrays[0] if self._flat else parts.copy()

    def show_goals(self, observations: Any, goals: NDArray[np.integer], envs: NDArray[np.integer]) -> None:
        """Put the goals [N] of some environments into observations, where the ledger has them no more."""
        if self._flat:
            at = self._turns.world.n_actions + N_DIRECTIONS + N_COLOURS
            observations[envs, at : at + _GOAL_SIZE] = GOAL_VECTORS[goals[envs]]
        else:
            observations["goal"][envs] = GOAL_VECTORS[goals[envs]]

    def final(self, step: Step) -> dict[str, Any]:
        """What infos say of the episodes that a step ended: their last observations, and their last infos."""
        ended = step.episode_ended.copy()
        numbers = (step.events, step.meta_elapsed > 0, step.illegal_actions, step.lengths, step.shortest)
        infos = _by_name((step.terminated & ended, *(values * ended.astype(_INT64) for values in numbers)), ended)
        observations, envs = np.full(self._n, None, object), np.flatnonzero(ended)
        last = self._turns.final_observation(CONTROLLER, step, envs)
        for env, observation in zip(envs, rows(last, flat=self._flat), strict=True):
            observations[env] = observation
        return {"final_obs": observations, "final_info": infos, "_final_obs": ended, "_final_info": ended.copy()}


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
        return (dict(zip(parts, of_one, strict=True)) for of_one in zip(*parts.values(), strict=True))
    parts["direction"] = np.eye(N_DIRECTIONS)[parts["direction"]]
    numbers = [parts[name].reshape(len(observation), -1) for name in sorted(parts)]
    return np.concatenate(numbers, axis=1, dtype=np.uint8, casting="unsafe")


def _by_name(infos: Iterable[NDArray], told: NDArray[np.bool_]) -> dict[str, NDArray]:
    """Infos by name, with Gymnasium's entries that say which environments they tell of."""
    named = {}
    for name, values in zip(INFOS, infos, strict=True):
        named[name], named[f"_{name}"] = values, told.copy()
    return named


@njit(cache=True, nogil=True)
def write_step_batch(
    outcomes, levels, steps, ledgers, begins_anew,
    rewards, terminated, truncated, success, events, elapsed, illegal, lengths, shortest, told,
    triples, vectors, images, goal_vectors, directions, keys, doors, masks,
):  # fmt: skip
    """Write what came of a step and what N environments show, in one call: see `write_results` and `write_batch`."""
    write_results(
        steps, ledgers, begins_anew,
        rewards, terminated, truncated, success, events, elapsed, illegal, lengths, shortest, told,
    )  # fmt: skip
    write_batch(outcomes, levels, ledgers, triples, vectors, images, goal_vectors, directions, keys, doors, masks)


@njit(cache=True, nogil=True)
def write_step_flat(
    outcomes, levels, steps, ledgers, begins_anew,
    rewards, terminated, truncated, success, events, elapsed, illegal, lengths, shortest, told,
    triples, vectors, rows,
):  # fmt: skip
    """Write what came of a step and what N environments show as rows: see `write_results` and `write_flat`."""
    write_results(
        steps, ledgers, begins_anew,
        rewards, terminated, truncated, success, events, elapsed, illegal, lengths, shortest, told,
    )  # fmt: skip
    write_flat(outcomes, levels, ledgers, triples, vectors, rows)


def _read_and_results() -> tuple:
    """Arrays of the types that both kernels begin with."""
    records = np.zeros(1, OUTCOME), np.zeros(1, LEVEL), np.zeros(1, STEP), np.zeros(1, LEDGER)
    flags, numbers = [np.zeros(1, _BOOL) for _ in range(3)], [np.zeros(1, _INT64) for _ in range(5)]
    return *records, True, np.zeros(1), *flags, *numbers, np.zeros(1, _BOOL), TRIPLES, GOAL_VECTORS


@cache
def _compiled_batch() -> Callable[..., None]:
    """Compile `write_step_batch` for the types of a batch's arrays."""
    images, goals = np.zeros((1, *IMAGE), _UINT8), np.zeros((1, 1), _FLOAT32)
    bits = [np.zeros((1, 1), _INT8) for _ in range(3)]
    return compiled(write_step_batch, *_read_and_results(), images, goals, np.zeros(1, _INT64), *bits)


@cache
def _compiled_flat() -> Callable[..., None]:
    """Compile `write_step_flat`, likewise."""
    return compiled(write_step_flat, *_read_and_results(), np.zeros((1, 1), _UINT8))
