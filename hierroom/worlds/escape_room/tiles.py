"""Tile codes as MiniGrid's triples: object, colour, and whether a door is open."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import COLOURS
from hierroom.support.kernel import Compiled
from hierroom.worlds.escape_room.constants import EMPTY, EXIT, KEY, LOCKED_DOOR, N_TILES, OPEN_DOOR, VIEW, WALL
from hierroom.worlds.escape_room.layout import OUTCOME
from hierroom.worlds.escape_room.view_kernels import write_images

# MiniGrid's object ids; its colour ids are the positions in `COLOURS`. They are copied because importing MiniGrid is
# slow (see `render`); a test checks that they agree.
EMPTY_ID, WALL_ID, DOOR_ID, KEY_ID, GOAL_ID = 1, 2, 4, 5, 8


_UINT8 = np.dtype(np.uint8)
"""A dtype made once, because from a type NumPy makes a dtype for every array."""


TRIPLES = np.zeros((N_TILES, 3), np.uint8)
"""MiniGrid's object id, its colour id, and 1 for an open door, for each tile code: [22, 3] uint8."""
TRIPLES[EMPTY] = EMPTY_ID, 0, 0
TRIPLES[EXIT] = GOAL_ID, COLOURS.index("green"), 0
TRIPLES[WALL] = WALL_ID, COLOURS.index("grey"), 0
for _colour in range(len(COLOURS)):
    TRIPLES[KEY + _colour] = KEY_ID, _colour, 0
    TRIPLES[OPEN_DOOR + _colour] = DOOR_ID, _colour, 1
    TRIPLES[LOCKED_DOOR + _colour] = DOOR_ID, _colour, 0
TRIPLES.setflags(write=False)


def encode(tiles: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Convert views of tile codes [N, 7, 7] to a new array of `TRIPLES` [N, 7, 7, 3], the agent's observations."""
    observations = np.empty((len(tiles), VIEW, VIEW, 3), _UINT8)
    _ENCODE.run(tiles, TRIPLES, observations)
    return observations


_STRIDED = np.zeros(2, OUTCOME)["tiles"]  # a field of a single record would count as contiguous
_ENCODE = Compiled(write_images, _STRIDED, TRIPLES, np.empty((2, VIEW, VIEW, 3), np.uint8))
