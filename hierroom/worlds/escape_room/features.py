"""The features of an EscapeRoom, which are small whole numbers that a network reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, GOAL_VECTORS, N_COLOURS, N_GOALS, NO_GOAL
from hierroom.support.kernel import Compiled, njit
from hierroom.worlds.escape_room.constants import (
    COL_STEP,
    EXIT,
    KEY,
    LOCKED_DOOR,
    MARGIN,
    MAX_SIZE,
    N_TILES,
    ONE,
    ROW_STEP,
    VIEW,
)
from hierroom.worlds.escape_room.layout import LEVEL, NO_MAPS, Maps
from hierroom.worlds.escape_room.rooms import room_at
from hierroom.worlds.escape_room.tiles import TRIPLES
from hierroom.worlds.world import Feature


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


N_CELLS = VIEW * VIEW
CLASS_STARTS = np.array([1, 2, 3, 4, 8, 16])
"""Distances at which classes 1 to 6 begin; the seven classes are 0, 1, 2, 3, 4 to 7, 8 to 15, and 16 or more cells."""
UNKNOWN_DISTANCE = 2 * len(CLASS_STARTS) + 1
"""The class of an unknown distance; the other classes go from far behind or left to far ahead or right."""


_GOAL_CATEGORIES = np.stack(
    [GOAL_VECTORS[:, :3] @ np.arange(1, 4), GOAL_VECTORS[:, 3:] @ np.arange(1, 1 + N_COLOURS)], axis=1
).astype(np.uint8)
"""(object, colour) of each goal id, both counted from 1; zeros for no goal."""
_GOAL_TILES = np.array([*KEY + np.arange(N_COLOURS), *LOCKED_DOOR + np.arange(N_COLOURS), EXIT, N_TILES], np.uint8)
"""The tile code of each goal id; the last one, of no goal, is no tile's."""
_GOAL_IDS = np.arange(N_GOALS)


def _goal_cells(observation: Any) -> NDArray:
    """Return the cell of the view with the goal [M, 1], or 49; colours differ, so there is at most one."""
    is_goal = observation.view.tiles.reshape(-1, N_CELLS) == _GOAL_TILES[observation.goals][:, None]
    return np.where(is_goal.any(axis=1), is_goal.argmax(axis=1), N_CELLS)[:, None]


def _places_of_goals(levels: np.ndarray, goals: NDArray[np.integer]) -> NDArray:
    """Return the `_places` [M, 2 G] of goals [M, G] that were seen."""
    return _PLACES.run(levels, _SEEN.run(levels, goals))


@njit(cache=True)
def _seen_at(levels, goals):
    """Return (row, col) [M, G, 2] of goals [M, G] seen this episode; zeros for others and for no goal."""
    cells = np.zeros((*goals.shape, 2), np.int64)
    for m, g in np.ndindex(goals.shape):
        goal = goals[m, g]
        if goal != NO_GOAL and (levels[m].seen >> goal) & 1:
            branch = levels[m].branches[goal % N_COLOURS]
            if goal < FIRST_DOOR_GOAL:
                row, col = levels[m].keys_at[branch, 0], levels[m].keys_at[branch, 1]
            elif goal < EXIT_GOAL:
                row, col = levels[m].doors_at[branch, 0], levels[m].doors_at[branch, 1]
            else:
                row, col = levels[m].exit_at[0], levels[m].exit_at[1]
            cells[m, g, 0], cells[m, g, 1] = row, col
    return cells


@njit(cache=True)
def _places(levels, cells):
    """Return how far ahead of the agent and to its right each cell [M, C, 2] is: [M, 2 C].

    Each is the class of the distance, -6 to 6, plus 6. A cell in row 0 means no cell and has `UNKNOWN_DISTANCE`.
    """
    places = np.full((cells.shape[0], 2 * cells.shape[1]), UNKNOWN_DISTANCE)
    for m in range(cells.shape[0]):
        row_step, col_step = ROW_STEP[levels[m].direction], COL_STEP[levels[m].direction]
        for c in range(cells.shape[1]):
            if cells[m, c, 0] > 0:
                down, east = cells[m, c, 0] - levels[m].row, cells[m, c, 1] - levels[m].col
                places[m, 2 * c] = _class_of(down * row_step + east * col_step)
                places[m, 2 * c + 1] = _class_of(down * col_step - east * row_step)
    return places


@njit(cache=True)
def _class_of(distance):
    classes = np.searchsorted(CLASS_STARTS, abs(distance), side="right")
    return len(CLASS_STARTS) + (classes if distance > 0 else -classes)


_SEEN = Compiled(_seen_at, np.zeros(1, LEVEL), np.zeros((2, 4), np.int64)[:, ::2])
_PLACES = Compiled(_places, np.zeros(1, LEVEL), np.zeros((1, 1, 2), np.int64))


def _by_colour(observation: Any, what: str) -> NDArray:
    return observation.view.levels[what][:, None] >> observation.view.levels["branches"] & 1


def _goal_status(observation: Any) -> NDArray:
    """Return for each goal [M, 13]: 0 never seen, 1 seen this episode, 2 a key in hand or an open door."""
    status = observation.view.levels["seen"][:, None] >> _GOAL_IDS & 1
    achieved = np.concatenate([_by_colour(observation, "keys"), _by_colour(observation, "doors")], axis=1)
    status[:, :EXIT_GOAL][achieved > 0] = 2
    return status


_PLACE = UNKNOWN_DISTANCE + 1
_VIEW = Feature((N_TILES,) * N_CELLS, lambda seen: seen.view.tiles.reshape(-1, N_CELLS))

FEATURES: Mapping[str, Feature] = {
    "view": _VIEW,
    "view-ids": replace(_VIEW, vectors=TRIPLES.astype(np.float32)),
    "goal": Feature((4, 1 + N_COLOURS), lambda seen: _GOAL_CATEGORIES[seen.goals], is_of_goal=True, is_of_world=False),
    "goal-in-view": Feature((N_CELLS + 1,), _goal_cells, is_of_goal=True, is_of_world=False),
    "goal-place": Feature(  # a key in hand keeps the place where it was picked up
        (_PLACE,) * 2,
        lambda seen: _places_of_goals(seen.view.levels, seen.goals[:, None]),
        is_of_goal=True,
        is_of_world=False,
    ),
    "object-places": Feature(
        (_PLACE,) * 2 * N_GOALS,
        lambda seen: _places_of_goals(seen.view.levels, np.broadcast_to(_GOAL_IDS, (len(seen.view.levels), N_GOALS))),
        is_of_world=False,
    ),
    "doorway-places": Feature(
        (_PLACE,) * 4,
        lambda seen: _PLACES.run(seen.view.levels, seen.view.levels["doorways"].astype(np.int64)),
        memories=("doorways",),
        is_of_world=False,
    ),
    "frontier-places": Feature(
        (_PLACE,) * 4,
        lambda seen: _PLACES.run(seen.view.levels, nearest_frontiers(seen.view.levels, seen.view.maps)),
        memories=("explored",),
        is_of_world=False,
    ),
    "direction": Feature((4,), lambda seen: seen.view.levels["direction"][:, None]),
    "keys": Feature((2,) * N_COLOURS, lambda seen: _by_colour(seen, "keys")),
    "goal-status": Feature((3,) * N_GOALS, _goal_status, is_by_goal=True),
}
"""Features of an EscapeRoom.

- view: the tile of each cell in view; view-ids: the same, as object id, colour id and open bit
- goal: object and colour of the goal; goal-in-view: its cell in the view
- goal-place: about how far ahead of the agent and to its right the goal is, once seen this episode
- object-places: the same for each goal id; doorway-places: for the two doors opened or crossed last
- frontier-places: the same for floor next to unseen cells, the nearest in the agent's room and the nearest elsewhere
- direction; keys: the keys held, by colour
- goal-status: whether each goal was seen this episode, and whether the key is in hand or the door open

For a meta-controller, the goal is its last one."""
