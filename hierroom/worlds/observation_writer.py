"""Write the controllers' observations of all environments of a world into arrays."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.controller import observation_spaces
from hierroom.support.errors import InputError

MOST_BYTES = 2**29
"""Most memory of flat observations; a discrete number takes four bytes for each of its values."""


class ObservationWriter:
    """Writes the controllers' observations of all N environments of a world.

    The world's ``shown`` gives what is written; a world with kernels overrides `write`.
    """

    def __init__(self, world: Any) -> None:
        self._world = world
        self._parts = observation_spaces(world.observation_spaces, world.goals, world.n_actions)
        self._mask = np.ones((len(world), world.n_actions), np.int8)

    @property
    def space(self) -> spaces.Dict:
        """The space of one environment's observation, which is not too large to be flat."""
        require_flat(spaces.flatdim(space := spaces.Dict(self._parts)))
        return space

    def empty(self) -> dict[str, NDArray]:
        """Return new arrays for `write`, by name."""
        n = len(self._world)
        return {name: np.empty((n, *(space.shape or ())), space.dtype) for name, space in self._parts.items()}

    def write(self, goals: NDArray[np.integer], arrays: Iterable[NDArray]) -> None:
        """Write the current observations, with goals [N], into the arrays of `empty`."""
        world = self._world
        vectors = world.goals.vectors.take(goals, axis=0)
        shown = {**world.shown(world.everywhere), "goal": vectors, "action_mask": self._mask}
        if world.action_masks is not None:
            shown["action_mask"] = world.action_masks
        for name, array in zip(self._parts, arrays, strict=True):
            array[...] = shown[name]


def require_flat(n_numbers: int) -> None:
    """Refuse so many numbers of flat observations, before their memory is taken."""
    if 4 * n_numbers > MOST_BYTES:
        need, most = (f"{n_bytes / 1e6:,.0f} MB" for n_bytes in (4 * n_numbers, MOST_BYTES))
        raise InputError(f"flat observations would need {need}, and at most {most} are allowed: take them as dicts")
