"""Check a state of environments before kernels use it, because they check no bounds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hierroom.goals import MAX_GRID_ROOMS, N_COLOURS, N_GOALS
from hierroom.support.errors import InputError
from hierroom.support.kernel import Compiled, njit
from hierroom.support.schema import Array, of_records
from hierroom.worlds.env_config import SPLITS
from hierroom.worlds.escape_room.constants import (
    EMPTY,
    EXIT,
    KEY,
    LOCKED_DOOR,
    MARGIN,
    MAX_SIZE,
    MIN_SIZE,
    OPEN_DOOR,
    WALL,
)
from hierroom.worlds.escape_room.layout import LEVEL, MEMORIES, State

_INT32, _INT64 = 2**31 - 1, 2**63 - 1
RULES = (
    "the goal graph is a tree of its rooms",
    "branches is the inverse of colours",
    "walls surround the grid",
    "rooms lie inside the walls",
    "keys, doors and what was found are those of the rooms",
    "a key that is held and a door that is open were found",
    "doors_at names the cell of each door",
    "keys_at names the cell of each key",
    "the exit is where it is said to be",
    "the grid holds nothing else",
    "the agent stands on floor",
    "the bag holds the keys that are held, each once",
    "the key to drop is the last one picked up with a locked door",
    "has_ended is True at the exit and after the last step only",
    "all doors of a level that is drawn are opened from its first room",
)
"""Rules of a level and its grid in addition to the bounds, in the order in which `_broken_rule` checks them."""


def level_bounds(size: int, n_maps: int = 0) -> Mapping[str, tuple[Any, Any]]:
    """Return the bounds of each field of `layout.LEVEL`, in grids of ``size``; bool fields have none.

    If there are maps, every level must be of one of them.
    """
    edge, bits = size + 2 * MARGIN - 1, 2**N_COLOURS - 1
    return {
        "seed": (0, _INT64),
        "index": (0, _INT64),
        "episode": (0, _INT64 - 1),
        "max_steps": (1, _INT32),
        "remembers": (0, sum(MEMORIES.values())),
        "split": (0, max(SPLITS.values())),
        "map": (min(n_maps, 1), n_maps),
        "n_rooms": (2, MAX_GRID_ROOMS),
        "exit_room": (1, MAX_GRID_ROOMS - 1),
        **dict.fromkeys(("key_rooms", "door_rooms"), (0, MAX_GRID_ROOMS - 1)),
        "colours": (0, N_COLOURS - 1),
        "branches": (0, N_COLOURS - 1),
        **dict.fromkeys(("rectangles", "doors_at", "keys_at", "exit_at", "divider", "doorways"), (0, edge)),
        "row": (MARGIN + 1, edge - MARGIN - 1),
        "col": (MARGIN + 1, edge - MARGIN - 1),
        "direction": (0, 3),
        "steps": (0, _INT32),
        **dict.fromkeys(("keys", "doors", "found"), (0, bits)),
        "opened_at": (0, _INT32),
        "seen": (0, 2**N_GOALS - 1),
        "visited": (0, 2**size - 1),
        "explored": (0, 2**size - 1),
        "bag": (0, N_COLOURS - 1),
        "bag_size": (0, N_COLOURS),
        "carried": (-1, N_COLOURS - 1),
    }


def check_state(state: State) -> None:
    """Check that every field of a state is in its range, and that levels and grids are consistent."""
    grids, levels = state.grids, state.levels
    if not isinstance(levels, np.ndarray) or levels.dtype != LEVEL or levels.ndim != 1:
        raise InputError("the levels of a state must be an array [N] of records of layout.LEVEL")
    if not isinstance(grids, np.ndarray) or grids.ndim != 3 or not MIN_SIZE <= state.size <= MAX_SIZE:
        raise InputError(f"the grids of a state must be an array [N, side, side], {MIN_SIZE} to {MAX_SIZE} and margins")
    side = state.size + 2 * MARGIN
    Array(np.uint8, (len(levels), side, side), EMPTY, WALL).check(grids, "grids")
    bounds = level_bounds(state.size, len(state.maps))
    of_records(LEVEL, len(levels), bounds).check({name: levels[name] for name in LEVEL.names or ()}, "levels")
    if len(state.maps):
        _check_maps(state)
    env, rule = _CHECK.run(np.ascontiguousarray(levels), np.ascontiguousarray(grids))
    if rule >= 0:
        raise InputError(f"invalid state in environment {env}, which breaks the rule: {RULES[rule]}")


def _check_maps(state: State) -> None:
    if state.maps.grids.shape[1:] != state.grids.shape[1:]:
        raise InputError(f"the layouts have {state.maps.grids.shape[1] - 2 * MARGIN} cells a side, not {state.size}")
    kept, numbers = state.maps, state.levels["map"] - 1
    moves = ("keys_at",) if state.levels["can_drop"].any() else ()
    for name in _OF_MAP - {*moves}:
        if (state.levels[name] != kept.levels[name][numbers]).any():
            raise InputError(f"levels.{name} differs from that of the layout")
    if ((state.grids == WALL) != (kept.grids[numbers] == WALL)).any():
        raise InputError("the walls in grids differ from those of the layouts")


_OF_MAP = frozenset(
    ("n_rooms", "exit_room", "key_rooms", "door_rooms", "colours", "branches", "rectangles", "divider")
) | {"doors_at", "keys_at", "exit_at"}
"""Fields of a level that its map determines."""


@njit(cache=True)
def _first_broken_rule(levels, grids):
    """Return the first environment that breaks one of `RULES`, and the rule's number; -1 and -1 if none does."""
    for n in range(levels.shape[0]):
        rule = _broken_rule(levels[n], grids[n])
        if rule >= 0:
            return n, rule
    return -1, -1


@njit(cache=True)
def _is_inside(grid, row, col):
    return MARGIN < row < grid.shape[0] - 1 - MARGIN and MARGIN < col < grid.shape[1] - 1 - MARGIN


@njit(cache=True)
def _holds(grid, cell, tile):
    return grid[cell[0], cell[1]] == tile


@njit(cache=True)
def _is_tree(level):
    """Return whether the exit's room and the keys' rooms exist, and each key can be reached."""
    if level.exit_room >= level.n_rooms:
        return False
    for branch in range(level.n_rooms - 1):
        room, depth = branch + 1, 0
        while room > 0 and depth < level.n_rooms:
            room = level.key_rooms[room - 1]
            depth += 1
            if room >= level.n_rooms:
                return False
        if room > 0:
            return False
    return True


@njit(cache=True)
def _broken_rule(level, grid):
    """Return the number of the first of `RULES` that a level breaks, or -1; its fields must be in their bounds."""
    n_branches, side = level.n_rooms - 1, grid.shape[0]
    if not _is_tree(level):
        return 0
    for colour in range(N_COLOURS):
        if level.branches[level.colours[colour]] != colour:
            return 1
    things = 0
    for row in range(side):
        for col in range(side):
            if not _is_inside(grid, row, col) and grid[row, col] != WALL:
                return 2
            things += EMPTY < grid[row, col] < WALL
    for room in range(level.n_rooms):
        top, left, bottom, right = level.rectangles[room]
        if level.map:
            continue
        is_room = top <= bottom and left <= right
        if not (is_room and _is_inside(grid, top, left) and _is_inside(grid, bottom, right)):
            return 3
    if (level.keys | level.doors | level.found) >> n_branches:
        return 4
    if (level.keys | level.doors) & ~level.found:
        return 5
    lying = 0
    for branch in range(n_branches):
        door = OPEN_DOOR if level.doors >> branch & 1 else LOCKED_DOOR
        if not _holds(grid, level.doors_at[branch], door + level.colours[branch]):
            return 6
        if not level.keys >> branch & 1:
            lying += 1
            if not _holds(grid, level.keys_at[branch], KEY + level.colours[branch]):
                return 7
    if not _holds(grid, level.exit_at, EXIT):
        return 8
    if things != n_branches + lying + 1:
        return 9
    tile = grid[level.row, level.col]
    if not (tile < KEY or OPEN_DOOR <= tile < LOCKED_DOOR):
        return 10
    in_bag, carried = 0, -1
    for slot in range(level.bag_size):
        branch = level.bag[slot]
        if in_bag >> branch & 1:
            return 11
        in_bag |= 1 << branch
        if not level.doors >> branch & 1:
            carried = branch
    if in_bag != level.keys:
        return 11
    if level.carried != carried:
        return 12
    at_exit = level.row == level.exit_at[0] and level.col == level.exit_at[1]
    if level.has_ended != (at_exit or level.steps >= level.max_steps):
        return 13
    return 14 if not level.map and level.door_rooms.any() else -1


_CHECK = Compiled(_first_broken_rule, np.zeros(1, LEVEL), np.zeros((1, 1, 1), np.uint8))
