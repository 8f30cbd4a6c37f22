"""Compiled kernels with the rules of the world for one level; `batch_kernels` applies them to a batch.

A level is a record of `layout.LEVEL` and a grid of tile codes; both are updated in place. With ``NUMBA_DISABLE_JIT=1``
the same source runs as ordinary Python.
"""

import numpy as np

from hierroom.support.kernel import njit
from hierroom.worlds.escape_room.constants import (
    COL_STEP,
    DROP,
    EMPTY,
    EXIT,
    FORWARD,
    KEY,
    LEFT,
    LOCKED_DOOR,
    OPEN,
    OPEN_DOOR,
    PICKUP,
    RIGHT,
    ROW_STEP,
    WALL,
)
from hierroom.worlds.escape_room.view_kernels import look_and_remember, use_doorway, visit


@njit(cache=True)
def advance(level, grid, action, outcome):
    """Let the agent act once; an action that does not apply only costs the step."""
    outcome.achieved, outcome.n_first, outcome.reward, outcome.terminated = 0, 0, 0.0, False
    row, col = level.row + ROW_STEP[level.direction], level.col + COL_STEP[level.direction]
    tile = np.int64(grid[row, col])
    if action == FORWARD:
        if tile < KEY or OPEN_DOOR <= tile < LOCKED_DOOR:
            level.row, level.col = row, col
            if tile >= OPEN_DOOR:
                use_doorway(level, row, col)
            if tile == EXIT:
                outcome.achieved, outcome.n_first, outcome.reward, outcome.terminated = 1 << 12, 1, 1.0, True
    elif action == LEFT:
        level.direction = (level.direction + 3) & 3
    elif action == RIGHT:
        level.direction = (level.direction + 1) & 3
    elif action == PICKUP and KEY <= tile < OPEN_DOOR:
        branch = level.branches[tile - KEY]
        outcome.achieved, outcome.n_first = 1 << (tile - KEY), not (level.found >> branch) & 1
        level.keys |= 1 << branch
        level.found |= 1 << branch
        level.bag[level.bag_size] = branch
        level.bag_size += 1
        grid[row, col] = EMPTY
        update_carried(level)
    elif action == OPEN and LOCKED_DOOR <= tile < WALL:
        branch = level.branches[tile - LOCKED_DOOR]
        if (level.keys >> branch) & 1:
            outcome.achieved, outcome.n_first = 1 << (6 + tile - LOCKED_DOOR), 1
            level.doors |= 1 << branch
            level.opened_at[branch] = level.steps + 1
            use_doorway(level, row, col)
            grid[row, col] = tile - LOCKED_DOOR + OPEN_DOOR
            update_carried(level)
    elif action == DROP and level.can_drop and level.carried >= 0 and tile == EMPTY:
        branch = level.carried
        kept = 0
        for slot in range(level.bag_size):
            if level.bag[slot] != branch:
                level.bag[kept] = level.bag[slot]
                kept += 1
        level.bag_size = kept
        level.keys &= ~(1 << branch)
        grid[row, col] = KEY + level.colours[branch]
        level.keys_at[branch, 0], level.keys_at[branch, 1] = row, col
        update_carried(level)
    if outcome.n_first:
        level.visited[:] = 0
    outcome.is_novel = visit(level)
    level.steps += 1
    outcome.truncated = level.steps >= level.max_steps
    outcome.length = level.steps
    level.has_ended = outcome.terminated or outcome.truncated


@njit(cache=True)
def update_carried(level):
    """Find the key that the agent would drop: the last one picked up with its door still locked."""
    level.carried = -1
    for slot in range(level.bag_size):
        if not (level.doors >> level.bag[slot]) & 1:
            level.carried = level.bag[slot]


@njit(cache=True)
def advance_and_look(level, grid, action, outcome):
    """Let the agent act once, and write its view after the action."""
    advance(level, grid, action, outcome)
    seen = level.seen
    look_and_remember(level, grid, outcome.tiles)
    outcome.is_discovery = level.seen != seen
