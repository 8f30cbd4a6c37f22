"""The global state of an environment, for learners with a central critic: the whole grid, as no agent sees it."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.worlds.escape_room.constants import MARGIN
from hierroom.worlds.escape_room.layout import State
from hierroom.worlds.escape_room.render import cells_of
from hierroom.worlds.escape_room.tiles import TRIPLES

AGENT_ID = 10
"""MiniGrid's object id of the agent."""


def state_space(size: int) -> spaces.Box:
    """Return the space of `global_state` for grids of so many cells a side."""
    return spaces.Box(0, AGENT_ID, (size, size, 4), np.uint8)


def global_state(state: State, goal: int) -> NDArray[np.uint8]:
    """Return the level of one environment, and the goal that is pursued, or -1.

    It is [size, size, 4] uint8 by row and column: MiniGrid's object id and colour id; 1 for an open door, and where the
    agent is its direction; 1 for the cell of the goal that is pursued. A key that is held is not on the grid.
    """
    level, tiles = state.levels[0], state.grids[0, MARGIN:-MARGIN, MARGIN:-MARGIN]
    grid = np.zeros((*tiles.shape, 4), np.uint8)
    grid[..., :3] = TRIPLES[tiles]
    grid[level.row - MARGIN, level.col - MARGIN, :3] = AGENT_ID, 0, level.direction
    for row, col in cells_of(goal, tiles):
        grid[row, col, 3] = 1
    return grid
