"""Kernels of what a level remembers of its episode on request: see `layout.MEMORIES`."""

import numpy as np

from hierroom.support.kernel import njit
from hierroom.worlds.escape_room.constants import DOORWAYS, MARGIN, ONE, VISITED


@njit(cache=True)
def visit(level):
    """Mark the agent's cell as visited; return whether it is new, or False if visits are not remembered."""
    if not level.remembers & VISITED:
        return False
    row, bit = level.row - MARGIN, ONE << np.uint64(level.col - MARGIN)
    is_new = level.visited[row] & bit == 0
    level.visited[row] |= bit
    return is_new


@njit(cache=True)
def use_doorway(level, row, col):
    """Record the door that is opened or crossed now as the latest one, if doorways are remembered."""
    if not level.remembers & DOORWAYS:
        return
    latest = level.doorways[0]
    if latest[0] != row or latest[1] != col:
        earlier = level.doorways[1]
        earlier[0], earlier[1] = latest[0], latest[1]
        latest[0], latest[1] = row, col
