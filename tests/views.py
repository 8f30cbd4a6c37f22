"""Where the cells of a view are in the room."""

import numpy as np

from hierroom.world.kernels import COL_STEP, ROW_STEP, UNSEEN, VIEW


def in_view(room, view):
    """(row, col) and tile code of the cells that a view shows; on the agent's own it shows what is carried."""
    rows, cols = ROW_STEP[room.direction], COL_STEP[room.direction]
    for i, j in np.argwhere(view != UNSEEN):
        ahead, right = VIEW - 1 - j, i - VIEW // 2
        cell = room.row + ahead * rows + right * cols, room.col + ahead * cols - right * rows
        yield (int(cell[0]), int(cell[1])), int(view[i, j])
