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

    Args:
        rooms: [M] records of `layout.ROOM`.

    Returns:
        [M, 2, 2] (row, col) of the nearest in the room where the agent stands, and of the nearest anywhere else, zeros
        where there is none; an agent in a doorway stands in no room.
    """
    cells = np.zeros((rooms.shape[0], 2, 2), np.int64)
    for m in range(rooms.shape[0]):
        room = rooms[m]
        top, left, bottom, right = _rectangle_at(room)
        nearest = [2 * MAX_SIZE, 2 * MAX_SIZE]
        for line in range(1, MAX_SIZE - 1):
            seen = room.explored[line]
            surrounded = (seen << ONE) & (seen >> ONE) & room.explored[line - 1] & room.explored[line + 1]
            frontier, row, col = room.floor[line] & ~surrounded, line + MARGIN, MARGIN
            while frontier:
                if frontier & ONE:
                    place = 0 if top <= row <= bottom and left <= col <= right else 1
                    distance = abs(row - room.row) + abs(col - room.col)
                    if distance < nearest[place]:
                        nearest[place] = distance
                        cells[m, place, 0], cells[m, place, 1] = row, col
                frontier >>= ONE
                col += 1
    return cells


@njit(cache=True)
def _rectangle_at(room):
    """Top, left, bottom and right cell of the room where the agent stands; nothing is in that of a doorway."""
    for number in range(room.n_rooms):
        top, left, bottom, right = room.rectangles[number]
        if top <= room.row <= bottom and left <= room.col <= right:
            return top, left, bottom, right
    return 1, 1, 0, 0
