"""The memory layout of environments: records of a goal graph, a level and the outcome of a step; state and maps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, MAX_GRID_ROOMS, N_COLOURS, NO_GOAL, GoalGraph
from hierroom.support.arrays import freeze
from hierroom.support.errors import InputError
from hierroom.support.schema import Whole, record_type
from hierroom.worlds.escape_room.constants import (
    DOORWAYS,
    EMPTY,
    EXIT,
    EXPLORED,
    KEY,
    LOCKED_DOOR,
    MARGIN,
    MAX_SIZE,
    MIN_SIZE,
    VIEW,
    VISITED,
    WALL,
)
from hierroom.worlds.escape_room.level_map import LevelMap
from hierroom.worlds.seeds import SOURCE_FIELDS
from hierroom.worlds.world import OUTCOME_FIELDS

GRAPH = record_type(("n_rooms", "i4"), ("exit_room", "i4"), ("key_rooms", "i4", N_COLOURS))
"""A goal graph in the form that kernels read."""

LEVEL = record_type(
    *SOURCE_FIELDS,
    # The rules of the level.
    ("max_steps", "i4"),
    ("can_drop", "?"),
    ("remembers", "i4"),  # which of `MEMORIES` are kept, one bit each
    ("split", "i4"),  # number in `SPLITS` of the set of levels to draw from
    # The level. Row and column indices include the margin of walls.
    ("map", "i4"),  # number of the level in `Maps`, from 1; 0: it is drawn
    ("n_rooms", "i4"),
    ("exit_room", "i4"),
    ("key_rooms", "i4", N_COLOURS),
    ("colours", "i4", N_COLOURS),  # colour of branch room 1, 2, ...
    ("branches", "i4", N_COLOURS),  # inverse of colours: branch room - 1 of each colour
    ("door_rooms", "i4", N_COLOURS),  # room from which the door of branch room 1, 2, ... is opened
    # In a drawn level: top row, left col, bottom row, right col of rooms 0, 1, ...
    ("rectangles", "i4", (MAX_GRID_ROOMS, 4)),
    ("doors_at", "i4", (N_COLOURS, 2)),  # (row, col)
    ("keys_at", "i4", (N_COLOURS, 2)),  # (row, col) of its key, or of the key's cell before it was picked up
    ("exit_at", "i4", 2),  # (row, col)
    ("divider", "i4", 4),  # row or col at which each side of the centre is divided if it holds two rooms
    # The agent.
    ("row", "i4"),
    ("col", "i4"),
    ("direction", "i4"),
    ("steps", "i4"),
    ("keys", "i4"),  # bit b: the key of branch room b + 1 is held
    ("doors", "i4"),  # bit b: the door of branch room b + 1 is open
    ("doorways", "i4", (2, 2)),  # (row, col) of the last two doors opened or crossed, latest first, or 0
    ("opened_at", "i4", N_COLOURS),  # the step that opened the door, or 0 while it is locked
    ("found", "i4"),  # bit b: the key of branch room b + 1 was held at some time in this episode
    ("seen", "i4"),  # bit g: goal g was in view at some time in this episode
    # Per row, bit col (both without the margin): the agent was there since it last found a new key or opened a door.
    ("visited", "u8", MAX_SIZE),
    ("explored", "u8", MAX_SIZE),  # the same for cells that were in view in this episode
    ("bag", "i4", N_COLOURS),  # branches (room - 1) of the keys held, in the order of pick-up
    ("bag_size", "i4"),
    ("carried", "i4"),  # branch (room - 1) of the key that drop would put down, or -1
    ("has_ended", "?"),
)

OUTCOME = record_type(
    ("tiles", "u1", (VIEW, VIEW)),  # the view after this step, or the first one of the next episode if it ended
    ("final_tiles", "u1", (VIEW, VIEW)),  # the final view of the episode that this step ended
    *OUTCOME_FIELDS,
)


MEMORIES: Mapping[str, int] = {"visited": VISITED, "explored": EXPLORED, "doorways": DOORWAYS}
"""Memories that a level keeps of its episode on request, in the fields of `LEVEL` with the same names."""


@dataclass(frozen=True, eq=False)
class Maps:
    """The P fixed levels at the start of an episode; none if levels are drawn.

    Args:
        levels: [P] records of `LEVEL`; a direction of -1 is drawn for each episode.
        grids: [P, side, side] tile codes.
        rooms: [P, side, side] int8, the room of each cell; -1 in walls, doors and unreachable cells.
    """

    levels: np.ndarray
    grids: NDArray[np.uint8]
    rooms: NDArray[np.int8]

    def __post_init__(self) -> None:
        freeze(self)  # shared by all states of a world

    def __reduce__(self) -> tuple[type[Maps], tuple[np.ndarray, ...]]:
        """Make copies read-only too, because kernels are compiled for read-only arrays."""
        return Maps, (self.levels, self.grids, self.rooms)

    def __len__(self) -> int:
        return len(self.levels)

    def is_same(self, other: Maps) -> bool:
        """Return whether these are the same levels."""
        return self is other or all(np.array_equal(own, vars(other)[name]) for name, own in vars(self).items())


NO_MAPS = Maps(np.zeros(0, LEVEL), np.zeros((0, 1, 1), np.uint8), np.zeros((0, 1, 1), np.int8))


@dataclass(frozen=True)
class State:
    """The exact state of N environments: grids of tile codes, size + 2 * MARGIN a side, and records of `LEVEL`.

    ``maps`` are the fixed levels of the world.
    """

    grids: NDArray[np.uint8]
    levels: np.ndarray
    maps: Maps = NO_MAPS

    def __len__(self) -> int:
        return len(self.levels)

    def __getitem__(self, indices) -> State:
        """Copy the state of some environments; an integer index gives a batch of one."""
        chosen = np.atleast_1d(np.arange(len(self))[indices])
        return State(self.grids[chosen], self.levels.take(chosen), self.maps)  # an index would copy field by field

    def distances(self, goals: NDArray[np.integer]) -> NDArray[np.integer]:
        """Return the Manhattan distances [N] from agents to goals [N], ignoring walls; 0 for no goal (-1).

        The distance to a held key is that to the cell where it was picked up.
        """
        levels, envs = self.levels, np.arange(len(self))
        branches = levels["branches"][envs, goals % N_COLOURS]
        is_key, is_exit = goals < FIRST_DOOR_GOAL, goals == EXIT_GOAL
        cells = np.where(is_key[:, None], levels["keys_at"][envs, branches], levels["doors_at"][envs, branches])
        cells = np.where(is_exit[:, None], levels["exit_at"], cells)
        distances = abs(cells - np.stack([levels["row"], levels["col"]], axis=1)).sum(axis=1)
        return np.where(goals == NO_GOAL, 0, distances)

    def copy(self) -> State:
        """Return the same state in new arrays."""
        return State(self.grids.copy(), self.levels.copy(), self.maps)

    @property
    def size(self) -> int:
        """Number of cells along a side of the grid, outer walls included."""
        return self.grids.shape[1] - 2 * MARGIN


def empty_state(num_envs: int, size: int, maps: Maps = NO_MAPS) -> State:
    """Return the all-zero state of environments before their first episode."""
    Whole(MIN_SIZE, MAX_SIZE).check(size, "size")
    Whole(1, 2**31 - 1).check(num_envs, "num_envs")
    side = size + 2 * MARGIN
    return State(np.zeros((num_envs, side, side), np.uint8), np.zeros(num_envs, LEVEL), maps)


def graph_records(graphs: Sequence[GoalGraph]) -> np.ndarray:
    """Convert goal graphs to the records [P] from which kernels sample."""
    if not graphs:
        raise InputError("levels need at least one goal graph, but there is none")
    records = np.zeros(len(graphs), GRAPH)
    for record, graph in zip(records, graphs, strict=True):
        if graph.n_rooms > MAX_GRID_ROOMS:
            raise InputError(
                f"a grid holds at most {MAX_GRID_ROOMS} rooms (one colour for each locked door), "
                f"but the goal graph has {graph.n_rooms}"
            )
        record.n_rooms, record.exit_room = graph.n_rooms, graph.exit_room
        record.key_rooms[: graph.n_rooms - 1] = graph.key_rooms
    return records


def map_arrays(maps: Sequence[LevelMap], size: int) -> Maps:
    """Return the levels of maps, each in the upper left corner of a grid of ``size`` cells a side; the rest is wall."""
    side = size + 2 * MARGIN
    levels, grids = np.zeros(len(maps), LEVEL), np.full((len(maps), side, side), WALL, np.uint8)
    rooms = np.full(grids.shape, -1, np.int8)
    for number, (level, grid, one) in enumerate(zip(levels, grids, maps, strict=True)):
        drawn, found, n = one.drawn, one.rooms, len(one.rooms.colours)
        level.map, level.n_rooms, level.exit_room = number + 1, n + 1, found.exit_room
        level.key_rooms[:n], level.door_rooms[:n] = found.key_rooms, found.door_rooms
        level.colours[:] = (*found.colours, *sorted({*range(N_COLOURS)} - {*found.colours}))
        level.branches[level.colours] = np.arange(N_COLOURS)
        for cells, tile in ((drawn.floor, EMPTY), ([drawn.exit], EXIT)):
            for row, col in cells:
                grid[row + MARGIN, col + MARGIN] = tile
        for branch, colour in enumerate(found.colours):
            for at, cell, tile in (
                (level.keys_at, drawn.keys[colour], KEY),
                (level.doors_at, drawn.doors[colour], LOCKED_DOOR),
            ):
                at[branch] = np.add(cell, MARGIN)
                grid[tuple(at[branch])] = tile + colour
        level.exit_at[:] = np.add(drawn.exit, MARGIN)
        level.row, level.col = np.add(drawn.start, MARGIN)
        level.direction = one.direction
        for (row, col), room in found.room_of.items():
            rooms[number, row + MARGIN, col + MARGIN] = room
    return Maps(levels, grids, rooms)
