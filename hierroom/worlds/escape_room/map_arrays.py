"""The levels of text maps as the arrays that kernels read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hierroom.goals import N_COLOURS
from hierroom.worlds.escape_room.constants import EMPTY, EXIT, KEY, LOCKED_DOOR, MARGIN, WALL
from hierroom.worlds.escape_room.layout import LEVEL, Maps
from hierroom.worlds.escape_room.level_map import LevelMap


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
