"""Kernels that write observations directly into users' arrays."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import GOAL_VECTORS, N_COLOURS
from hierroom.support.kernel import Compiled, njit
from hierroom.worlds.escape_room.constants import VIEW
from hierroom.worlds.escape_room.layout import LEVEL, OUTCOME
from hierroom.worlds.escape_room.tiles import TRIPLES
from hierroom.worlds.escape_room.view_kernels import write_image
from hierroom.worlds.observation_writer import ObservationWriter

N_DIRECTIONS = 4
IMAGE, GOAL_SIZE = (VIEW, VIEW, 3), GOAL_VECTORS.shape[1]


@njit(cache=True, nogil=True)
def write_level(outcomes, levels, goal, triples, vectors, image, goal_vector, keys, doors):
    """Write the observation of a batch of one, with a goal or -1, and return the agent's direction.

    ``triples`` is `tiles.TRIPLES` and ``vectors`` `goals.GOAL_VECTORS`; the other arrays are those of `write_one`.
    """
    level = levels[0]
    write_image(outcomes[0].tiles, triples, image)
    for k in range(GOAL_SIZE):
        goal_vector[k] = vectors[goal, k]
    for colour in range(N_COLOURS):
        branch = level.branches[colour]
        keys[colour], doors[colour] = level.keys >> branch & 1, level.doors >> branch & 1
    return level.direction


@njit(cache=True, nogil=True)
def write_batch(outcomes, levels, goals, triples, vectors, images, directions, keys, doors, goal_vectors, masks):
    """Write the observations of N environments, with goals [N] and all actions legal: see `write_level`.

    Two short loops take less time than one, because all that each writes fits into the registers.
    """
    for n in range(outcomes.shape[0]):
        write_image(outcomes[n].tiles, triples, images[n])
    for n in range(outcomes.shape[0]):
        level, goal = levels[n], goals[n]
        for k in range(GOAL_SIZE):
            goal_vectors[n, k] = vectors[goal, k]
        for colour in range(N_COLOURS):
            branch = level.branches[colour]
            keys[n, colour], doors[n, colour] = level.keys >> branch & 1, level.doors >> branch & 1
        directions[n] = level.direction
    masks[:] = 1


_UINT8, _INT8, _INT64, _FLOAT32 = (np.dtype(kind) for kind in (np.uint8, np.int8, np.int64, np.float32))
"""Dtypes made once, because from a type NumPy makes a dtype for every array."""
_DIRECTIONS = tuple(np.int64(direction) for direction in range(N_DIRECTIONS))


def write_one(outcomes: np.ndarray, levels: np.ndarray, goal: int) -> dict[str, Any]:
    """Return the observation of a batch of one, with the vector of a goal (-1: none), in new arrays."""
    image, vector = np.empty(IMAGE, _UINT8), np.empty(GOAL_SIZE, _FLOAT32)
    keys, doors = np.empty(N_COLOURS, _INT8), np.empty(N_COLOURS, _INT8)
    direction = _LEVEL.run(outcomes, levels, goal, TRIPLES, GOAL_VECTORS, image, vector, keys, doors)
    return {
        "observation": image,
        "goal": vector,
        "direction": _DIRECTIONS[direction],
        "keys_held": keys,
        "doors_open": doors,
    }


class LevelWriter(ObservationWriter):
    """Writes the controllers' observations of EscapeRooms."""

    def write(self, goals: NDArray[np.integer], arrays: Iterable[NDArray]) -> None:
        """Write the current observations, with goals [N], into the arrays of `empty`."""
        _BATCH.run(self._world.outcomes, self._world.state.levels, goals, TRIPLES, GOAL_VECTORS, *arrays)


_READ = np.zeros(1, OUTCOME), np.zeros(1, LEVEL)
_GOALS = np.zeros(4, np.int64)[::2]  # strided like a field of records; an array of one number would be contiguous
_IMAGE, _VECTOR, _BITS = np.zeros((1, *IMAGE), _UINT8), np.zeros((1, 1), _FLOAT32), np.zeros((1, 1), _INT8)
_TABLES = TRIPLES, GOAL_VECTORS
_LEVEL = Compiled(write_level, *_READ, 1, *_TABLES, _IMAGE[0], _VECTOR[0], _BITS[0], _BITS[0])
_BATCH = Compiled(write_batch, *_READ, _GOALS, *_TABLES, _IMAGE, np.zeros(1, _INT64), _BITS, _BITS, _VECTOR, _BITS)
