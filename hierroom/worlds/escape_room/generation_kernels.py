"""Compiled kernels that generate one level: rooms, doors, keys and the exit."""

import numpy as np

from hierroom.support.kernel import copy_matrix, njit
from hierroom.worlds.escape_room.constants import (
    ALL_LEVELS,
    COL_STEP,
    EMPTY,
    EVALUATION_LEVELS,
    EXIT,
    KEY,
    LOCKED_DOOR,
    MARGIN,
    MIN_CENTRE,
    MIN_SIDE,
    ROW_STEP,
    WALL,
)
from hierroom.worlds.escape_room.view_kernels import visit
from hierroom.worlds.random_kernels import random_below, shuffle, stream_key


@njit(cache=True)
def generate(level, grid, graphs):
    """Begin the next episode on a new random level that the split allows."""
    begin(level)
    graph = graphs[random_below(level, graphs.shape[0])]
    draw(level, grid, graph)
    while level.split != ALL_LEVELS and is_held_out(grid) != (level.split == EVALUATION_LEVELS):
        draw(level, grid, graph)


@njit(cache=True)
def is_held_out(grid):
    """Return whether a layout is kept for evaluation; a hash of all tiles (FNV-1a) selects an eighth of them."""
    digest = np.uint64(0xCBF29CE484222325)
    for tile in grid.reshape(-1):
        digest = (digest ^ np.uint64(tile)) * np.uint64(0x100000001B3)
    return digest >> np.uint64(61) == 0


@njit(cache=True)
def begin(level):
    """Start the random numbers of the next episode, and clear the state of the last one."""
    level.episode += 1
    level.key = stream_key(level.seed, level.index, level.episode)
    level.n_drawn = np.uint64(0)
    level.steps, level.keys, level.doors, level.found, level.seen, level.bag_size = 0, 0, 0, 0, 0, 0
    level.carried, level.has_ended = -1, False
    level.bag[:], level.opened_at[:], level.doorways[:], level.visited[:], level.explored[:] = 0, 0, 0, 0, 0


@njit(cache=True)
def generate_of_maps(level, grid, maps, map_grids):
    """Begin the next episode on the level of one of the maps."""
    begin(level)
    chosen = random_below(level, maps.shape[0])
    start = maps[chosen]
    level.map, level.n_rooms, level.exit_room = start.map, start.n_rooms, start.exit_room
    for branch in range(6):
        level.key_rooms[branch], level.door_rooms[branch] = start.key_rooms[branch], start.door_rooms[branch]
        level.colours[branch], level.branches[branch] = start.colours[branch], start.branches[branch]
    copy_matrix(start.doors_at, level.doors_at)
    copy_matrix(start.keys_at, level.keys_at)
    level.exit_at[0], level.exit_at[1] = start.exit_at[0], start.exit_at[1]
    level.rectangles[:], level.divider[:] = 0, 0
    level.row, level.col, level.direction = start.row, start.col, start.direction
    if start.direction < 0:
        level.direction = random_below(level, 4)
    copy_matrix(map_grids[chosen], grid)
    visit(level)


@njit(cache=True)
def draw(level, grid, graph):
    """Draw a level with a goal graph.

    Up to four branch rooms occupy one side of the centre each; a fifth room divides one side, and a sixth also the
    opposite side. Every level is solvable by construction. Each room is a rectangle at least two cells wide and deep,
    and the exit is never directly behind its door, so it cuts off no cell. Keys can be picked up and therefore never
    block the way.
    """
    n_branches = graph.n_rooms - 1
    level.map, level.n_rooms, level.exit_room = 0, graph.n_rooms, graph.exit_room
    for branch in range(6):
        level.key_rooms[branch] = graph.key_rooms[branch]
    level.door_rooms[:] = 0
    level.rectangles[:], level.doors_at[:], level.keys_at[:] = 0, 0, 0  # the last episode may have had more rooms

    for colour in range(6):
        level.colours[colour] = colour
    shuffle(level, level.colours)
    for branch in range(6):
        level.branches[level.colours[branch]] = branch

    # The centre's walls, then the side of the centre to which each corner of the grid belongs.
    size = grid.shape[0] - 2 * MARGIN
    depths = (size - 4 - MIN_CENTRE) // 2 - MIN_SIDE + 1
    low, high = MARGIN + 1 + MIN_SIDE, MARGIN + size - 2 - MIN_SIDE
    walls = np.empty(4, np.int64)
    walls[0], walls[1] = high - random_below(level, depths), high - random_below(level, depths)
    walls[2], walls[3] = low + random_below(level, depths), low + random_below(level, depths)
    for side in range(4):
        first, last = (walls[2], walls[0]) if side % 2 else (walls[3], walls[1])
        level.divider[side] = first + 2 + random_below(level, last - first - 3)
    corners = np.empty((2, 2), np.int64)
    for row in range(2):
        for col in range(2):
            corners[row, col] = random_below(level, 2)

    # The side of each branch room: slot = side + 4 * part.
    slots = np.empty(6, np.int64)
    for side in range(4):
        slots[side] = side
    shuffle(level, slots[:4])
    if n_branches > 4:
        halved = slots[0]
        slots[0], slots[4] = halved + 4, halved + 8
        if n_branches > 5:
            opposite = (halved + 2) % 4
            for slot in range(1, 4):
                if slots[slot] == opposite:
                    slots[slot] = opposite + 4
            slots[5] = opposite + 8
        shuffle(level, slots[:n_branches])
        corners[:] = halved % 2

    grid[:] = WALL
    centre = level.rectangles[0]
    centre[0], centre[1], centre[2], centre[3] = walls[3] + 1, walls[2] + 1, walls[1] - 1, walls[0] - 1
    grid[centre[0] : centre[2] + 1, centre[1] : centre[3] + 1] = EMPTY
    for branch in range(n_branches):
        carve(level, grid, branch, slots[branch] % 4, slots[branch] // 4, walls, corners)

    door, side = level.doors_at[level.exit_room - 1], slots[level.exit_room - 1] % 4
    behind_row, behind_col = door[0] + ROW_STEP[side], door[1] + COL_STEP[side]
    exit_room = level.rectangles[level.exit_room]
    level.exit_at[0], level.exit_at[1] = place(level, grid, exit_room, behind_row, behind_col, EXIT)
    for branch in range(n_branches):
        home, key_at = level.rectangles[level.key_rooms[branch]], level.keys_at[branch]
        key_at[0], key_at[1] = place(level, grid, home, -1, -1, KEY + level.colours[branch])
    row, col = place(level, grid, centre, -1, -1, EMPTY)
    level.row, level.col, level.direction = row, col, random_below(level, 4)
    level.visited[:] = 0
    visit(level)


@njit(cache=True)
def carve(level, grid, branch, side, part, walls, corners):
    """Give a branch room its rectangle on one side of the centre, and its door in the centre's wall.

    Args:
        level: the level.
        grid: its grid.
        branch: the branch room, counted from 0.
        side: side of the centre, a direction.
        part: 0 for the whole side, 1 or 2 for its first or second half.
        walls: [4] the centre's wall lines (east col, south row, west col, north row).
        corners: [2, 2] by (is south, is east): 1 if that corner of the grid belongs to the north or south side.
    """
    size = grid.shape[0] - 2 * MARGIN
    is_vertical = side % 2  # the south and north sides extend along columns
    low_line, high_line = (walls[2], walls[0]) if is_vertical else (walls[3], walls[1])
    is_far = 1 if side < 2 else 0
    first, last = low_line + 1, high_line - 1
    low_corner = corners[is_far, 0] if is_vertical else 1 - corners[0, is_far]
    high_corner = corners[is_far, 1] if is_vertical else 1 - corners[1, is_far]
    low = MARGIN + 1 if low_corner else first
    high = MARGIN + size - 2 if high_corner else last
    if part != 0:
        divider = level.divider[side]
        if part == 1:
            last, high = divider - 1, divider - 1
        else:
            first, low = divider + 1, divider + 1
    line = walls[side]
    near = line + 1 if is_far else MARGIN + 1
    far = MARGIN + size - 2 if is_far else line - 1
    door = first + random_below(level, last - first + 1)
    rectangle = level.rectangles[branch + 1]
    if is_vertical:
        rectangle[0], rectangle[1], rectangle[2], rectangle[3] = near, low, far, high
        level.doors_at[branch, 0], level.doors_at[branch, 1] = line, door
    else:
        rectangle[0], rectangle[1], rectangle[2], rectangle[3] = low, near, high, far
        level.doors_at[branch, 0], level.doors_at[branch, 1] = door, line
    grid[rectangle[0] : rectangle[2] + 1, rectangle[1] : rectangle[3] + 1] = EMPTY
    grid[level.doors_at[branch, 0], level.doors_at[branch, 1]] = LOCKED_DOOR + level.colours[branch]


@njit(cache=True)
def place(level, grid, rectangle, forbidden_row, forbidden_col, tile):
    """Put a tile on a random empty cell of a rectangle except the forbidden cell; return (row, col)."""
    top, left, bottom, right = rectangle[0], rectangle[1], rectangle[2], rectangle[3]
    free = 0
    for row in range(top, bottom + 1):
        for col in range(left, right + 1):
            if grid[row, col] == EMPTY and not (row == forbidden_row and col == forbidden_col):
                free += 1
    rank = random_below(level, free)
    for row in range(top, bottom + 1):
        for col in range(left, right + 1):
            if grid[row, col] == EMPTY and not (row == forbidden_row and col == forbidden_col):
                if rank == 0:
                    grid[row, col] = tile
                    return row, col
                rank -= 1
    return -1, -1
