"""Where there is more to be seen: floor that was in view this episode, beside a cell that was not (Yamauchi 1997)."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from hierroom.world.kernels import MARGIN, ONE
from hierroom.world.layout import MAX_SIZE


@njit(cache=True)
def nearest_frontiers(rooms: np.ndarray) -> NDArray[np.int64]:
    """The frontier cells nearest to the agents, in rows and columns added up; of equals the first by row and column.

    Floor is what lies in a room or is an open door.

    Args:
        rooms: [M] records of `layout.ROOM`.

    Returns:
        [M, 2, 2] (row, col) of the nearest in the room where the agent stands, and of the nearest anywhere else, zeros
        where there is none; an agent in a doorway stands in no room.
    """
    cells = np.zeros((rooms.shape[0], 2, 2), np.int64)
    for m in range(rooms.shape[0]):
        room = rooms[m]
        for number in range(room.n_rooms):
            top, left, bottom, right = room.rectangles[number]
            is_here = top <= room.row <= bottom and left <= room.col <= right
            nearest = cells[m, 0 if is_here else 1]
            inside = (ONE << np.uint64(right - left + 1)) - ONE
            for row in range(top, bottom + 1):
                frontier, col = (_frontier(room, row) >> np.uint64(left - MARGIN)) & inside, left
                while frontier:
                    if frontier & ONE:
                        _keep_nearer(room, row, col, nearest)
                    frontier >>= ONE
                    col += 1
        for branch in range(room.n_rooms - 1):
            row, col = room.doors_at[branch]
            if (room.doors >> branch) & 1 and (_frontier(room, row) >> np.uint64(col - MARGIN)) & ONE:
                _keep_nearer(room, row, col, cells[m, 1])
    return cells


@njit(cache=True)
def _frontier(room, row):
    """Bits of the cells of a row that were seen, but not all four beside them."""
    line = row - MARGIN
    seen = room.explored[line]
    return seen & ~((seen << ONE) & (seen >> ONE) & room.explored[line - 1] & room.explored[line + 1])


@njit(cache=True)
def _keep_nearer(room, row, col, nearest):
    """Make a cell the nearest one, if it is."""
    if nearest[0] == 0 or _rank(room, row, col) < _rank(room, nearest[0], nearest[1]):
        nearest[0], nearest[1] = row, col


@njit(cache=True)
def _rank(room, row, col):
    """A number that grows with the distance, then with the row, then with the column."""
    return ((abs(row - room.row) + abs(col - room.col)) * 2 * MAX_SIZE + row) * 2 * MAX_SIZE + col
