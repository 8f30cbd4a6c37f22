"""What agents see as compiled kernels: observations are written once, into the arrays that users get."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import GOAL_VECTORS, N_COLOURS
from hierroom.support.compile.kernel import compiled, njit
from hierroom.worlds.escape_room.constants import VIEW
from hierroom.worlds.escape_room.layout import LEVEL, OUTCOME
from hierroom.worlds.escape_room.tiles import TRIPLES

N_DIRECTIONS = 4
IMAGE, GOAL_SIZE = (VIEW, VIEW, 3), GOAL_VECTORS.shape[1]
N_CELLS = VIEW * VIEW
ONE, TWO = np.uint64(1), np.uint64(2)
N_NUMBERS = N_DIRECTIONS + N_COLOURS + GOAL_SIZE + N_COLOURS + N_CELLS * 3
"""Numbers of a flat observation besides the action mask."""


@njit(cache=True)
def write_image(tiles, triples, image):
    """Write a view [7, 7] of tile codes as an image [7, 7, 3] in MiniGrid's numbers."""
    for i in range(VIEW):
        for j in range(VIEW):
            tile = np.uint64(tiles[i, j])
            image[i, j, 0], image[i, j, 1], image[i, j, 2] = triples[tile, 0], triples[tile, 1], triples[tile, 2]


@njit(cache=True, nogil=True)
def write_one(outcomes, levels, goal, triples, vectors, image, goal_vector, keys, doors):
    """Write what the only environment of a batch shows; returns the agent's direction.

    Args:
        outcomes: [1] record of `layout.OUTCOME`.
        levels: [1] record of `layout.LEVEL`.
        goal: the goal id that is shown, or -1.
        triples: `tiles.TRIPLES`.
        vectors: `goals.GOAL_VECTORS`.
        image: [7, 7, 3] uint8, written.
        goal_vector: [9] float32, written.
        keys: [6] int8, written.
        doors: [6] int8, written.
    """
    level = levels[0]
    write_image(outcomes[0].tiles, triples, image)
    for k in range(GOAL_SIZE):
        goal_vector[k] = vectors[goal, k]
    for colour in range(N_COLOURS):
        branch = level.branches[colour]
        keys[colour], doors[colour] = level.keys >> branch & 1, level.doors >> branch & 1
    return level.direction


@njit(cache=True, nogil=True)
def write_batch(outcomes, levels, ledgers, triples, vectors, images, goal_vectors, directions, keys, doors, masks):
    """Write what N environments show, all actions legal; as `write_one`, into arrays of N rows.

    The goals are those of records of the ledger. Two short loops take less time than one: all that is written fits
    into the registers.
    """
    for n in range(outcomes.shape[0]):
        write_image(outcomes[n].tiles, triples, images[n])
    for n in range(outcomes.shape[0]):
        level, goal = levels[n], ledgers[n].goals
        for k in range(GOAL_SIZE):
            goal_vectors[n, k] = vectors[goal, k]
        for colour in range(N_COLOURS):
            branch = level.branches[colour]
            keys[n, colour], doors[n, colour] = level.keys >> branch & 1, level.doors >> branch & 1
        directions[n] = level.direction
    masks[:] = 1


@njit(cache=True, nogil=True)
def write_flat(outcomes, levels, ledgers, triples, vectors, rows):
    """Write what N environments show as rows of numbers, one after the other: see `vector_arrays.flat_space`."""
    n_actions, first = rows.shape[1] - N_NUMBERS, rows.shape[1] - N_CELLS * 3
    for n in range(outcomes.shape[0]):
        tiles, row = outcomes[n].tiles, rows[n]
        for i in range(VIEW):
            for j in range(VIEW):
                tile, at = np.uint64(tiles[i, j]), np.uint64(first + (i * VIEW + j) * 3)
                row[at], row[at + ONE], row[at + TWO] = triples[tile, 0], triples[tile, 1], triples[tile, 2]
    for n in range(outcomes.shape[0]):
        level, goal, row = levels[n], ledgers[n].goals, rows[n]
        for k in range(n_actions):
            row[k] = 1
        at = n_actions
        for k in range(N_DIRECTIONS):
            row[at + k] = k == level.direction
        at += N_DIRECTIONS
        for colour in range(N_COLOURS):
            branch = level.branches[colour]
            row[at + colour] = level.doors >> branch & 1
            row[at + N_COLOURS + GOAL_SIZE + colour] = level.keys >> branch & 1
        at += N_COLOURS
        for k in range(GOAL_SIZE):
            row[at + k] = vectors[goal, k]


_UINT8, _INT8, _FLOAT32 = np.dtype(np.uint8), np.dtype(np.int8), np.dtype(np.float32)


def empty_parts() -> tuple[NDArray, ...]:
    """New arrays of an environment's image, goal, keys and doors, to be written."""
    image, goal = np.empty(IMAGE, _UINT8), np.empty(GOAL_SIZE, _FLOAT32)
    return image, goal, np.empty(N_COLOURS, _INT8), np.empty(N_COLOURS, _INT8)


@cache
def compiled_one() -> Callable[..., int]:
    """Compile `write_one` for the types of a world's arrays."""
    return compiled(write_one, np.zeros(1, OUTCOME), np.zeros(1, LEVEL), 1, TRIPLES, GOAL_VECTORS, *empty_parts())
