"""The room of a cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.support.kernel import Compiled, njit
from hierroom.worlds.escape_room.layout import LEVEL, NO_MAPS, Maps


@njit(cache=True)
def room_at(level, rooms, row, col):
    """Return the room that contains a cell, or -1 for a doorway; ``rooms`` are those of `Maps`."""
    if level.map:
        return np.int64(rooms[level.map - 1, row, col])
    for r in range(level.n_rooms):
        top, left, bottom, right = level.rectangles[r]
        if top <= row <= bottom and left <= col <= right:
            return r
    return -1


@njit(cache=True)
def find_rooms(levels, rooms):
    """Return the room [M] of each level's agent: see `rooms_of`."""
    found = np.empty(levels.shape[0], np.int64)
    for m in range(levels.shape[0]):
        found[m] = room_at(levels[m], rooms, levels[m].row, levels[m].col)
    return found


def rooms_of(levels: np.ndarray, maps: Maps) -> NDArray[np.int64]:
    """Return the room [M] that each agent stands in, or -1 in a doorway."""
    return _FIND.run(np.ascontiguousarray(levels), maps.rooms)


_FIND = Compiled(find_rooms, np.zeros(1, LEVEL), NO_MAPS.rooms)
