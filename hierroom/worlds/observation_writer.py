"""Write the controllers' observations of all environments of a world into arrays."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.controller import observation_spaces


class ObservationWriter:
    """Writes the controllers' observations of all N environments of a world.

    The world's ``shown`` gives what is written; a world with kernels overrides `write`.
    """

    def __init__(self, world: Any) -> None:
        self._world = world
        self._parts = observation_spaces(world.observation_spaces, world.goals, world.n_actions)
        self._mask = np.ones((len(world), world.n_actions), np.int8)

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
