"""Tile codes in MiniGrid's terms: object, colour and whether a door is open."""

import numpy as np
from minigrid.core.constants import COLOR_TO_IDX, OBJECT_TO_IDX
from numpy.typing import NDArray

from hierroom.goals import COLOURS
from hierroom.world.kernels import EMPTY, EXIT, KEY, LOCKED_DOOR, N_TILES, OPEN_DOOR, WALL, encode_tiles


def _triples() -> NDArray[np.uint8]:
    triples = np.zeros((N_TILES, 3), np.uint8)
    triples[EMPTY, 0] = OBJECT_TO_IDX["empty"]
    triples[EXIT, :2] = OBJECT_TO_IDX["goal"], COLOR_TO_IDX["green"]
    triples[WALL, :2] = OBJECT_TO_IDX["wall"], COLOR_TO_IDX["grey"]
    for colour, name in enumerate(COLOURS):
        triples[KEY + colour] = OBJECT_TO_IDX["key"], COLOR_TO_IDX[name], 0
        triples[OPEN_DOOR + colour] = OBJECT_TO_IDX["door"], COLOR_TO_IDX[name], 1
        triples[LOCKED_DOOR + colour] = OBJECT_TO_IDX["door"], COLOR_TO_IDX[name], 0
    triples.setflags(write=False)
    return triples


TRIPLES = _triples()
"""[22, 3] uint8: MiniGrid's object id, its colour id, and 1 for an open door."""


def encode(tiles: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Views of tile codes [N, 7, 7] as the fresh array [N, 7, 7, 3] of `TRIPLES` that agents are shown."""
    observations = np.empty((*tiles.shape, 3), np.uint8)
    encode_tiles(tiles, TRIPLES, observations)
    return observations
