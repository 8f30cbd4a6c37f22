"""Frontiers: floor that was seen this episode and is next to an unseen cell (Yamauchi 1997)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.support.kernel import Compiled, njit
from hierroom.worlds.escape_room.constants import MARGIN, MAX_SIZE, ONE
from hierroom.worlds.escape_room.layout import LEVEL, NO_MAPS, Maps
from hierroom.worlds.escape_room.rooms import room_at


def nearest_frontiers(levels: np.ndarray, maps: Maps) -> NDArray[np.int64]:
    """Find the frontier cells nearest to the agents by Manhattan distance; ties go to the first by row and column.

    Floor is every cell of a room and every open door.

    Returns:
        [M, 2, 2] (row, col) of the nearest cell in the agent's room, and of the nearest anywhere else; zeros if there
        is none. An agent in a doorway is in no room.
    """
    return _SEARCH.run(np.ascontiguousarray(levels), maps.rooms)


@njit(cache=True)
def find_frontiers(levels, rooms):
    """Find the cells that `nearest_frontiers` returns."""
    cells = np.zeros((levels.shape[0], 2, 2), np.int64)
    for m in range(levels.shape[0]):
        level = levels[m]
        here = room_at(level, rooms, level.row, level.col)
        n_lines = rooms.shape[1] - 2 * MARGIN if level.map else MAX_SIZE
        for row in range(MARGIN + 1, MARGIN + n_lines - 1):
            frontier, col = _frontier(level, row), MARGIN
            while frontier:
                if frontier & ONE:
                    room = room_at(level, rooms, row, col)
                    if room >= 0:
                        _keep_nearer(level, row, col, cells[m, 0 if room == here else 1])
                frontier >>= ONE
                col += 1
        for branch in range(level.n_rooms - 1):
            row, col = level.doors_at[branch]
            if (level.doors >> branch) & 1 and (_frontier(level, row) >> np.uint64(col - MARGIN)) & ONE:
                _keep_nearer(level, row, col, cells[m, 1])
    return cells


@njit(cache=True)
def _frontier(level, row):
    """Return bits of the seen cells of a row that have an unseen neighbour."""
    line = row - MARGIN
    seen = level.explored[line]
    return seen & ~((seen << ONE) & (seen >> ONE) & level.explored[line - 1] & level.explored[line + 1])


@njit(cache=True)
def _keep_nearer(level, row, col, nearest):
    if nearest[0] == 0 or _rank(level, row, col) < _rank(level, nearest[0], nearest[1]):
        nearest[0], nearest[1] = row, col


@njit(cache=True)
def _rank(level, row, col):
    return ((abs(row - level.row) + abs(col - level.col)) * 2 * MAX_SIZE + row) * 2 * MAX_SIZE + col


_SEARCH = Compiled(find_frontiers, np.zeros(1, LEVEL), NO_MAPS.rooms)
