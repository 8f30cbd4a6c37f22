"""Numbers that the whole world shares: tile codes, actions, sizes and directions."""

import numpy as np

# Tile codes: the content of one cell of a grid or view. Light passes the codes from EMPTY up to below LOCKED_DOOR.
UNSEEN, EMPTY, EXIT, KEY, OPEN_DOOR, LOCKED_DOOR, WALL = 0, 1, 2, 3, 9, 15, 21
N_TILES = 22

FORWARD, LEFT, RIGHT, PICKUP, OPEN, DROP = range(6)
VIEW = 7
MARGIN = 5  # width of the walls around the grid; views reach no further beyond it, so look-ups need no bounds checks
MIN_SIZE, MAX_SIZE = 11, 63  # least and greatest side of a grid, outer walls included
MIN_SIDE, MIN_CENTRE = 2, 3  # least depth of a branch room, and least width of the centre room, in cells

# Directions as in MiniGrid: 0 east, 1 south, 2 west, 3 north; a right turn adds one.
ROW_STEP = np.array([0, 1, 0, -1])
COL_STEP = np.array([1, 0, -1, 0])

ALL_LEVELS, TRAINING_LEVELS, EVALUATION_LEVELS = 0, 1, 2
# What a level can remember of its episode on request: bits of ``remembers``, see `layout.MEMORIES`.
VISITED, EXPLORED, DOORWAYS = 1, 2, 4

ONE = np.uint64(1)
