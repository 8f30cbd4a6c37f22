"""The rules of the world as compiled scalar functions on one level; `batch_kernels` applies them to a batch.

A level is a record of `layout.LEVEL` and a grid of tile codes; both are updated in place. With ``NUMBA_DISABLE_JIT=1``
the same source runs as ordinary Python.
"""

import numpy as np
from numba import config, typeof

from hierroom.compile.kernel import njit

# Tile codes: the content of one cell of a grid or view. Light passes the codes from EMPTY up to below LOCKED_DOOR.
UNSEEN, EMPTY, EXIT, KEY, OPEN_DOOR, LOCKED_DOOR, WALL = 0, 1, 2, 3, 9, 15, 21
N_TILES = 22

FORWARD, LEFT, RIGHT, PICKUP, OPEN, DROP = range(6)
VIEW = 7
MARGIN = 5  # width of the walls around the grid, as far as a view reaches beyond it, so that no look-up checks bounds
MIN_SIDE, MIN_CENTRE = 2, 3  # least depth of a branch room, and least width of the centre room, in cells

# Directions as in MiniGrid: 0 east, 1 south, 2 west, 3 north; a right turn adds one.
ROW_STEP = np.array([0, 1, 0, -1])
COL_STEP = np.array([1, 0, -1, 0])

ALL_LEVELS, TRAINING_LEVELS, EVALUATION_LEVELS = 0, 1, 2
# What a level can remember of its episode on request: bits of ``remembers``, see `layout.MEMORIES`.
VISITED, EXPLORED, DOORWAYS = 1, 2, 4

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
MIX_2 = np.uint64(0x94D049BB133111EB)
ONE = np.uint64(1)


@njit(cache=True)
def mix(bits):
    """The finalizer of SplitMix64 (Steele, Lea & Flood 2014): a bijection of 64 bits that scrambles them."""
    bits = (bits ^ (bits >> np.uint64(30))) * MIX_1
    bits = (bits ^ (bits >> np.uint64(27))) * MIX_2
    return bits ^ (bits >> np.uint64(31))


@njit(cache=True)
def stream_key(seed, index, episode):
    """The 64-bit key of an environment's episode, whose i-th random number is ``mix(key + i * GOLDEN)``."""
    key = mix(np.uint64(seed) + GOLDEN)
    key = mix(key ^ (np.uint64(index) + GOLDEN))
    return mix(key ^ (np.uint64(episode) + GOLDEN))


@njit(cache=True)
def random_below(level, bound):
    """The episode's next random integer in ``0..bound - 1``."""
    level.n_drawn += np.uint64(1)
    bits = mix(level.key + level.n_drawn * GOLDEN)
    return np.int64(((bits >> np.uint64(32)) * np.uint64(bound)) >> np.uint64(32))


@njit(cache=True)
def place(level, grid, rectangle, forbidden_row, forbidden_col, tile):
    """Put a tile on a random empty cell of a rectangle except the forbidden cell; returns (row, col)."""
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


@njit(cache=True)
def shuffle(level, items):
    """Shuffle a small array in place (Fisher and Yates)."""
    for last in range(items.shape[0] - 1, 0, -1):
        other = random_below(level, last + 1)
        items[last], items[other] = items[other], items[last]


@njit(cache=True)
def carve(level, grid, branch, side, part, walls, corners):
    """Give a branch room its rectangle on one side of the centre, and its door in the centre's wall.

    Args:
        level: the level, updated in place.
        grid: its grid, updated in place.
        branch: the branch room, counted from 0.
        side: side of the centre, 0 east, 1 south, 2 west, 3 north.
        part: 0 for the whole side, 1 or 2 for its first or second half.
        walls: [4] int64, the centre's wall lines (east col, south row, west col, north row).
        corners: [2, 2] int64, indexed by (is south, is east): 1 if that corner of the grid belongs to the north or
            south side.
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
def visit(level):
    """Mark the agent's cell as visited; returns whether it is new, or False if visits are not remembered."""
    if not level.remembers & VISITED:
        return False
    row, bit = level.row - MARGIN, ONE << np.uint64(level.col - MARGIN)
    is_new = level.visited[row] & bit == 0
    level.visited[row] |= bit
    return is_new


@njit(cache=True)
def is_held_out(grid):
    """Whether a layout is kept for evaluation: so is an eighth of them, by a hash (FNV-1a) of all tiles."""
    digest = np.uint64(0xCBF29CE484222325)
    for tile in grid.reshape(-1):
        digest = (digest ^ np.uint64(tile)) * np.uint64(0x100000001B3)
    return digest >> np.uint64(61) == 0


@njit(cache=True)
def generate(level, grid, graphs):
    """Begin the next episode on a new level, of those that the level's split allows."""
    level.episode += 1
    level.key = stream_key(level.seed, level.index, level.episode)
    level.n_drawn = np.uint64(0)
    graph = graphs[random_below(level, graphs.shape[0])]
    draw(level, grid, graph)
    while level.split != ALL_LEVELS and is_held_out(grid) != (level.split == EVALUATION_LEVELS):
        draw(level, grid, graph)


@njit(cache=True)
def draw(level, grid, graph):
    """Draw a level with a goal graph.

    Up to four branch rooms occupy one side of the centre each; a fifth room divides one side, and a sixth also the
    opposite side. Every level is solvable by construction: each room is a rectangle at least two cells wide and deep,
    so the exit, which never lies directly behind its door, cuts off no cell; keys can be picked up and therefore never
    block the way.
    """
    n_branches = graph.n_rooms - 1
    level.n_rooms, level.exit_room = graph.n_rooms, graph.exit_room
    level.key_rooms[:] = graph.key_rooms
    level.steps, level.keys, level.doors, level.found, level.seen, level.bag_size = 0, 0, 0, 0, 0, 0
    level.carried, level.has_ended = -1, False
    level.bag[:], level.rectangles[:], level.opened_at[:] = 0, 0, 0  # clear the last episode's values
    level.doors_at[:], level.keys_at[:], level.doorways[:], level.explored[:] = 0, 0, 0, 0

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


def spread(lit, clear):
    """Propagate light through one row of the view; returns (visible cells of the row, lit cells of the next row ahead).

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
    """[128, 128] uint16: `spread` for every row (lit, clear), as ``seen | ahead << 7``."""
    seen, ahead = spread(*np.meshgrid(np.arange(1 << VIEW), np.arange(1 << VIEW), indexing="ij"))
    return (seen | ahead << VIEW).astype(np.uint16)


LIGHT = light_table()


@njit(cache=True)
def look(level, grid, view):
    """Write the agent's view: view[i, j] is the cell i - 3 to its right and 6 - j ahead, as in MiniGrid's image.

    A step spends most of its time here. Cells are therefore addressed by one flat index, which is cast to unsigned so
    that Numba skips the handling of negative indices, and rows that no light reaches are not read.
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
def update_carried(level):
    """Find the key that the agent would drop: of those whose door is still locked, the last one picked up."""
    level.carried = -1
    for slot in range(level.bag_size):
        if not (level.doors >> level.bag[slot]) & 1:
            level.carried = level.bag[slot]


@njit(cache=True)
def use_doorway(level, row, col):
    """Record the door that is opened or crossed now as the latest one, if doorways are remembered."""
    if not level.remembers & DOORWAYS:
        return
    latest = level.doorways[0]
    if latest[0] != row or latest[1] != col:
        level.doorways[1] = latest
        latest[0], latest[1] = row, col


@njit(cache=True)
def advance(level, grid, action, outcome):
    """Let the agent act once; an action that does not apply only costs the step."""
    outcome.event, outcome.is_first, outcome.reward, outcome.terminated = -1, False, 0.0, False
    row, col = level.row + ROW_STEP[level.direction], level.col + COL_STEP[level.direction]
    tile = np.int64(grid[row, col])
    if action == FORWARD:
        if tile < KEY or OPEN_DOOR <= tile < LOCKED_DOOR:
            level.row, level.col = row, col
            if tile >= OPEN_DOOR:
                use_doorway(level, row, col)
            if tile == EXIT:
                outcome.event, outcome.is_first, outcome.reward, outcome.terminated = 12, True, 1.0, True
    elif action == LEFT:
        level.direction = (level.direction + 3) & 3
    elif action == RIGHT:
        level.direction = (level.direction + 1) & 3
    elif action == PICKUP and KEY <= tile < OPEN_DOOR:
        branch = level.branches[tile - KEY]
        outcome.event, outcome.is_first = tile - KEY, not (level.found >> branch) & 1
        level.keys |= 1 << branch
        level.found |= 1 << branch
        level.bag[level.bag_size] = branch
        level.bag_size += 1
        grid[row, col] = EMPTY
        update_carried(level)
    elif action == OPEN and LOCKED_DOOR <= tile < WALL:
        branch = level.branches[tile - LOCKED_DOOR]
        if (level.keys >> branch) & 1:
            outcome.event, outcome.is_first = 6 + tile - LOCKED_DOOR, True
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
    if outcome.is_first:
        level.visited[:] = 0
    outcome.is_novel = visit(level)
    level.steps += 1
    outcome.truncated = level.steps >= level.max_steps
    outcome.length = level.steps
    level.has_ended = outcome.terminated or outcome.truncated


@njit(cache=True)
def advance_and_look(level, grid, action, outcome):
    """Let the agent act once, and write its view after the action."""
    advance(level, grid, action, outcome)
    seen = level.seen
    look_and_remember(level, grid, outcome.tiles)
    outcome.is_discovery = level.seen != seen


@njit(cache=True, nogil=True)
def turn_uniforms(levels, turns, uniforms):
    """Write uniforms [N, K] in [0, 1) for a turn of each environment, determined by episode and turn number."""
    for n in range(levels.shape[0]):
        key = mix(levels[n].key ^ mix(np.uint64(turns[n]) + GOLDEN))
        for k in range(uniforms.shape[1]):
            uniforms[n, k] = (mix(key + np.uint64(k) * GOLDEN) >> np.uint64(11)) * 2.0**-53


@njit(cache=True, nogil=True)
def encode_tiles(tiles, triples, observations):
    """Write views [N, 7, 7] of tile codes as observations [N, 7, 7, 3]; ``triples`` is `tiles.TRIPLES`."""
    for n in range(tiles.shape[0]):
        for i in range(VIEW):
            for j in range(VIEW):
                tile = tiles[n, i, j]
                observations[n, i, j, 0] = triples[tile, 0]
                observations[n, i, j, 1] = triples[tile, 1]
                observations[n, i, j, 2] = triples[tile, 2]


if config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue] - Numba sets it at run time
    # In ordinary Python, uint64 scalars warn of overflow, which the random number generator relies on.
    turn_uniforms = np.errstate(over="ignore")(turn_uniforms)


def compiled(kernel, *arrays):
    """Compile a kernel for arguments of the same types as ``arrays``; the caller must only pass such arguments.

    Calling a kernel by its name makes Numba look up the types of the arguments in each call. With six arrays, four of
    them records, that takes several times as long as the step of one environment.
    """
    return kernel.compile(tuple(typeof(array) for array in arrays)) if hasattr(kernel, "compile") else kernel
