"""Kernels of the agent's view, as in MiniGrid: light that spreads through 7 x 7 cells; and of a level's memories."""

import numpy as np

from hierroom.support.kernel import njit
from hierroom.worlds.escape_room.constants import (
    COL_STEP,
    DOORWAYS,
    EMPTY,
    EXIT,
    EXPLORED,
    KEY,
    LOCKED_DOOR,
    MARGIN,
    ONE,
    OPEN_DOOR,
    ROW_STEP,
    UNSEEN,
    VIEW,
    VISITED,
)


def spread(lit, clear):
    """Propagate light through one row of the view; return (visible cells of the row, lit cells of the next row ahead).

    These are MiniGrid's two sweeps (``Grid.process_vis``), left to right and then right to left, as bit shifts.

    Args:
        lit: 7 bits, the cells that light reaches from the row behind; a number or an array.
        clear: 7 bits, the cells that light passes; a number or an array.
    """
    sources = lit & clear
    chain = clear & (clear << 1)
    sources = sources | (sources << 1) & clear
    sources = sources | (sources << 2) & chain
    sources = (sources | (sources << 4) & chain & (chain << 2)) & 0x3F
    seen = lit | (sources << 1)
    ahead = sources | (sources << 1)
    sources = seen & clear
    chain = clear & (clear >> 1)
    sources = sources | (sources >> 1) & clear
    sources = sources | (sources >> 2) & chain
    sources = (sources | (sources >> 4) & chain & (chain >> 2)) & 0x7E
    return seen | (sources >> 1), ahead | sources | (sources >> 1)


def light_table():
    """Return `spread` of every row (lit, clear) as ``seen | ahead << 7``: [128, 128] uint16."""
    seen, ahead = spread(*np.meshgrid(np.arange(1 << VIEW), np.arange(1 << VIEW), indexing="ij"))
    return (seen | ahead << VIEW).astype(np.uint16)


LIGHT = light_table()


@njit(cache=True)
def look(level, grid, view):
    """Write the agent's view: view[i, j] is the cell i - 3 to its right and 6 - j ahead, as in MiniGrid's image.

    A step spends most of its time here. So a cell has one flat index, which is cast to unsigned to let Numba skip the
    handling of negative indices. Rows that no light reaches are not read.
    """
    cells, side = grid.reshape(-1), grid.shape[1]
    ahead = ROW_STEP[level.direction] * side + COL_STEP[level.direction]
    right = COL_STEP[level.direction] * side - ROW_STEP[level.direction]
    leftmost = level.row * side + level.col - (VIEW // 2) * right
    lit = 1 << (VIEW // 2)
    tiles_seen = 0
    for j in range(VIEW - 1, -1, -1):
        if lit == 0:
            for i in range(VIEW):
                view[i, j] = UNSEEN
        else:
            clear = 0
            for i in range(VIEW):
                tile = cells[np.uint64(leftmost + i * right)]
                clear |= (EMPTY <= tile < LOCKED_DOOR) << i
            light = LIGHT[np.uint64(lit), np.uint64(clear)]
            seen, lit = np.int64(light & 127), np.int64(light >> VIEW)
            for i in range(VIEW):
                tile = np.int64(cells[np.uint64(leftmost + i * right)]) * ((seen >> i) & 1)
                view[i, j] = tile
                tiles_seen |= 1 << tile
            leftmost += ahead
    view[VIEW // 2, VIEW - 1] = EMPTY if level.carried < 0 else KEY + level.colours[level.carried]
    doors_seen = (tiles_seen >> OPEN_DOOR) | (tiles_seen >> LOCKED_DOOR)
    level.seen |= (tiles_seen >> KEY) & 63 | (doors_seen & 63) << 6 | (tiles_seen >> EXIT & 1) << 12


@njit(cache=True)
def look_and_remember(level, grid, view):
    """Write the agent's view, and mark its cells as explored if that is remembered."""
    look(level, grid, view)
    if not level.remembers & EXPLORED:
        return
    row_step, col_step = ROW_STEP[level.direction], COL_STEP[level.direction]
    for j in range(VIEW):
        for i in range(VIEW):
            if view[i, j] != UNSEEN:  # such a cell is never beyond the outer walls
                ahead, right = VIEW - 1 - j, i - VIEW // 2
                row = np.uint64(level.row - MARGIN + ahead * row_step + right * col_step)
                level.explored[row] |= ONE << np.uint64(level.col - MARGIN + ahead * col_step - right * row_step)


@njit(cache=True)
def write_image(tiles, triples, image):
    """Write a view [7, 7] of tile codes as an image [7, 7, 3] in MiniGrid's numbers; ``triples`` is `tiles.TRIPLES`."""
    for i in range(VIEW):
        for j in range(VIEW):
            tile = np.uint64(tiles[i, j])
            image[i, j, 0], image[i, j, 1], image[i, j, 2] = triples[tile, 0], triples[tile, 1], triples[tile, 2]


@njit(cache=True, nogil=True)
def write_images(tiles, triples, images):
    """Write views [N, 7, 7] as images [N, 7, 7, 3]."""
    for n in range(tiles.shape[0]):
        write_image(tiles[n], triples, images[n])


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
