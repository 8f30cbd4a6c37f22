"""Write the controllers' observations of all environments of a world into arrays, or as rows of numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import DTypeLike, NDArray

from hierroom.controller import observation_spaces
from hierroom.support.errors import InputError

MOST_BYTES = 2**29
"""Most memory of flat observations; a discrete number takes four bytes for each of its values."""


class ObservationWriter:
    """Writes the controllers' observations of all N environments of a world; all actions are legal.

    A flat observation is one row of numbers, in the order of `gymnasium.spaces.flatten`. The world's ``shown`` gives
    what is written; a world with kernels overrides `write`.

    Attributes:
        flat_space: the space of one environment's flat observation; only if ``flat``.
    """

    flat_type: Any = np.float32  # of the numbers of a flat observation

    def __init__(self, world: Any, *, flat: bool) -> None:
        self._world, self._flat = world, flat
        self._parts = observation_spaces(world.observation_spaces, world.goals, world.n_actions)
        self._space = spaces.Dict(self._parts)
        self._mask = np.ones((len(world), world.n_actions), np.int8)
        if flat:
            require_flat(len(world) * spaces.flatdim(self._space))
            row: Any = spaces.flatten_space(self._space)
            with np.errstate(over="ignore"):  # bounds of float64 become infinite
                low, high = row.low.astype(self.flat_type), row.high.astype(self.flat_type)
            self.flat_space: spaces.Box = spaces.Box(low, high, dtype=self.flat_type)

    def empty(self) -> tuple[tuple[NDArray, ...], dict[str, NDArray]]:
        """Return new arrays for `write`, and the same arrays by name (an empty dict if flat)."""
        n = len(self._world)
        if self._flat:
            return (np.empty((n, *self.flat_space.shape), self.flat_type),), {}
        arrays = {name: np.empty((n, *(space.shape or ())), space.dtype) for name, space in self._parts.items()}
        return tuple(arrays.values()), arrays

    def write(self, goals: NDArray[np.integer], arrays: tuple[NDArray, ...]) -> None:
        """Write the current observations, with goals [N], into arrays from `empty`."""
        world = self._world
        vectors = world.goals.vectors.take(goals, axis=0)
        shown = {**world.shown(world.everywhere), "goal": vectors, "action_mask": self._mask}
        if world.action_masks is not None:
            shown["action_mask"] = world.action_masks
        if self._flat:
            np.concatenate([_rows(shown[name], one) for name, one in self._space.items()], axis=1, out=arrays[0])
            return
        for name, array in zip(self._parts, arrays, strict=True):
            array[...] = shown[name]

    def write_goals(self, observations: Any, goals: NDArray[np.integer], envs: NDArray[np.integer]) -> None:
        """Write the vectors of goals [N] into the observations of some environments."""
        vectors = self._world.goals.vectors[goals[envs]]
        if not self._flat:
            observations["goal"][envs] = vectors
            return
        names = [*self._space]
        at = sum(spaces.flatdim(self._space[name]) for name in names[: names.index("goal")])
        observations[envs, at : at + vectors.shape[1]] = vectors


def require_flat(n_numbers: int) -> None:
    """Refuse so many numbers of flat observations, before their memory is taken."""
    if 4 * n_numbers > MOST_BYTES:
        need, most = (f"{n_bytes / 1e6:,.0f} MB" for n_bytes in (4 * n_numbers, MOST_BYTES))
        raise InputError(f"flat observations would need {need}, and at most {most} are allowed: take them as dicts")


def flat_rows(parts: dict[str, NDArray], space: spaces.Dict, dtype: DTypeLike) -> NDArray:
    """Return M observations by name as rows of numbers [M, K], as `gymnasium.spaces.flatten` orders them."""
    rows = [_rows(parts[name], one) for name, one in space.items()]
    return np.concatenate(rows, axis=1, dtype=dtype, casting="unsafe")


def _rows(values: NDArray, space: spaces.Space) -> NDArray[np.float32]:
    if isinstance(space, spaces.Box):
        return values.reshape(len(values), -1).astype(np.float32)
    return np.array([spaces.flatten(space, value) for value in values], np.float32).reshape(len(values), -1)
