"""Positions in the level of a view's cells and of the goals in them."""

import numpy as np

from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL
from hierroom.worlds.escape_room.constants import (
    COL_STEP,
    EXIT,
    KEY,
    LOCKED_DOOR,
    OPEN_DOOR,
    ROW_STEP,
    UNSEEN,
    VIEW,
    WALL,
)


def in_view(level, view):
    """(row, col) and tile code of the cells that a view shows; the agent's cell shows the carried key."""
    rows, cols = ROW_STEP[level.direction], COL_STEP[level.direction]
    for i, j in np.argwhere(view != UNSEEN):
        ahead, right = VIEW - 1 - j, i - VIEW // 2
        cell = level.row + ahead * rows + right * cols, level.col + ahead * cols - right * rows
        yield (int(cell[0]), int(cell[1])), int(view[i, j])


def shown_goals(level, view):
    """(goal id, cell) of each key, door and exit in a view; not the key that is carried."""
    for cell, tile in in_view(level, view):
        if tile == EXIT:
            yield EXIT_GOAL, cell
        elif KEY <= tile < OPEN_DOOR and cell != (level.row, level.col):
            yield tile - KEY, cell
        elif OPEN_DOOR <= tile < WALL:
            yield FIRST_DOOR_GOAL + (tile - OPEN_DOOR) % (LOCKED_DOOR - OPEN_DOOR), cell
