"""Mutants that no test can kill: by module the line, with or without what became of it, and why."""

from collections.abc import Mapping

_ALWAYS = "there is always a goal, but where goals must be seen, and there no goal is legal anyway"
_NAMED = "makes arguments positional that everybody names"
_FAR = "far beyond what is ever played"
_SAMPLES = "samples for the compiler, which is not there: it alone reads their types and notices their number"
_COMPILER = "for the compiler, which is not there"
_WARNS = "decides whether NumPy warns that numbers overflow, as they shall"
_LAST = "the last axis is the axis 1"
_BOUND = "a bound on rounding, whose size alone counts: near where they change places either formula is right"
_SAME = "another number, and the same order"
_TABLE = "a larger table, of which the same part is read"
_PARTS = "in how many parts the samples are summed changes the time alone"
_LONGER = "a part that reaches into the next, of which the first numbers alone are used"
_FIRST = "replaced before it is used, but where there are no nodes and nothing to take"
_ROW = "a row more, above the last, which is that of no goal either way"
_NO_CELL = "a cell is (0, 0) where there is none, and else within the outer walls, from 6 on"
_NEGATIVE = "any negative number means to NumPy what is left"
_ROOM = "more memory than is needed either way, as where each node of a graph has an edge"
_CORNER = "cell 0 is a corner of the walls"
_LAST_DIGIT = "a number that differs in its last digit"
_CODES = "codes of the search alone, which stay apart"
_STRICT = "whether lengths that are equal are compared"
_SQUARE = "grids are square"
_REACHED = "one node more after all has been searched, which was never written: nothing defined comes of it"
_NOT_FORBIDDEN = "no cell has a negative row or column, of which one is enough"
_WALL = "beyond a room is its wall, which is not empty"
_SECOND_HALF = "a part that is neither 0 nor 1 is the second half"
_NO_RULE = "where no rule is broken, any negative number says so, and the environment is not read"
_NO_SEARCH = "where there is no path, it is not read"
_MORE_SEARCHED = "one more place is searched, through which no way is shorter"

NOT_TRIED: Mapping[str, str] = {
    "@njit(": _COMPILER,
    "if TYPE_CHECKING:": "for type checkers, which alone read it",
    "if config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue] - Numba sets it at run time": _WARNS,
}
"""How lines of any module begin whose mutants are not tried."""
EXPLAINED: Mapping[str, Mapping[str, str]] = {
    "frontier": {
        "if nearest[0] == 0 or _rank(level, row, col) < _rank(level, nearest[0], nearest[1]):"
        "  ->  if nearest[0] == 0 or _rank(level, row, col) <= _rank(level, nearest[0], nearest[1]):": (
            "no two cells have the same rank"
        ),
        "return ((abs(row - level.row) + abs(col - level.col)) * 2 * MAX_SIZE + row) * 2 * MAX_SIZE + col"
        "  ->  return ((abs(row - level.row) + abs(col - level.col)) * 3 * MAX_SIZE + row) * 2 * MAX_SIZE + col": _SAME,
        "return ((abs(row - level.row) + abs(col - level.col)) * 2 * MAX_SIZE + row) * 2 * MAX_SIZE + col"
        "  ->  return ((abs(row - level.row) + abs(col - level.col)) * 2 * MAX_SIZE + row) * 3 * MAX_SIZE + col": _SAME,
        "if nearest[0] == 0 or _rank(level, row, col) < _rank(level, nearest[0], nearest[1]):"
        "  ->  if nearest[ 1] == 0 or _rank(level, row, col) < _rank(level, nearest[0], nearest[1]):": _NO_CELL,
    },
    "view": {
        "doors_seen = (tiles_seen >> OPEN_DOOR) | (tiles_seen >> LOCKED_DOOR)"
        "  ->  doors_seen = (tiles_seen << OPEN_DOOR) | (tiles_seen >> LOCKED_DOOR)": (
            "who sees an open door has seen it locked: it is opened by who stands before it"
        ),
        "sources = (sources | (sources >> 4) & chain & (chain >> 2)) & 0x7E"
        "  ->  sources = (sources | (sources >> 4) & chain & (chain >> 2)) & 127": (
            "what lights the first cell, from behind or from the second, lights the cell ahead of it, too"
        ),
        'seen, ahead = spread(*np.meshgrid(np.arange(1 << VIEW), np.arange(1 << VIEW), indexing="ij"))'
        '  ->  seen, ahead = spread(*np.meshgrid(np.arange( 2 << VIEW), np.arange(1 << VIEW), indexing="ij"))': _TABLE,
        'seen, ahead = spread(*np.meshgrid(np.arange(1 << VIEW), np.arange(1 << VIEW), indexing="ij"))'
        '  ->  seen, ahead = spread(*np.meshgrid(np.arange(1 << VIEW), np.arange( 2 << VIEW), indexing="ij"))': _TABLE,
        "cells, side = grid.reshape(-1), grid.shape[1]  ->  cells, side = grid.reshape(- 2), grid.shape[1]": _NEGATIVE,
        "tiles_seen = 0  ->  tiles_seen = 1": "tile 0 is what is not seen, and nobody asks for it",
        "if lit == 0:  ->  if lit == 1:": (
            "light from the row behind reaches no cell or at least two, and where it reaches none nothing is seen"
        ),
    },
    "generation": {
        "for row in range(top, bottom + 1):  ->  for row in range(top, bottom + 2):": _WALL,
        "for col in range(left, right + 1):  ->  for col in range(left, right + 2):": _WALL,
        "walls = np.empty(4, np.int64)  ->  walls = np.empty( 5, np.int64)": _ROOM,
        "corners = np.empty((2, 2), np.int64)  ->  corners = np.empty(( 3, 2), np.int64)": _ROOM,
        "corners = np.empty((2, 2), np.int64)  ->  corners = np.empty((2, 3), np.int64)": _ROOM,
        "slots = np.empty(6, np.int64)  ->  slots = np.empty( 7, np.int64)": _ROOM,
        "for side in range(4):  ->  for side in range( 5):": "the fifth slot is written again before it is read",
        "for slot in range(1, 4):  ->  for slot in range(1, 5):": "the fifth slot is not on the opposite side",
        "for tile in grid.reshape(-1):  ->  for tile in grid.reshape(- 2):": _NEGATIVE,
        "size = grid.shape[0] - 2 * MARGIN  ->  size = grid.shape[ 1] - 2 * MARGIN": _SQUARE,
        "key_at[0], key_at[1] = place(level, grid, home, -1, -1, KEY + level.colours[branch])"
        "  ->  key_at[0], key_at[1] = place(level, grid, home, +1, -1, KEY + level.colours[branch])": _NOT_FORBIDDEN,
        "key_at[0], key_at[1] = place(level, grid, home, -1, -1, KEY + level.colours[branch])"
        "  ->  key_at[0], key_at[1] = place(level, grid, home, -1, +1, KEY + level.colours[branch])": _NOT_FORBIDDEN,
        "key_at[0], key_at[1] = place(level, grid, home, -1, -1, KEY + level.colours[branch])"
        "  ->  key_at[0], key_at[1] = place(level, grid, home, - 2, -1, KEY + level.colours[branch])": _NOT_FORBIDDEN,
        "key_at[0], key_at[1] = place(level, grid, home, -1, -1, KEY + level.colours[branch])"
        "  ->  key_at[0], key_at[1] = place(level, grid, home, -1, - 2, KEY + level.colours[branch])": _NOT_FORBIDDEN,
        "row, col = place(level, grid, centre, -1, -1, EMPTY)"
        "  ->  row, col = place(level, grid, centre, +1, -1, EMPTY)": _NOT_FORBIDDEN,
        "row, col = place(level, grid, centre, -1, -1, EMPTY)"
        "  ->  row, col = place(level, grid, centre, -1, +1, EMPTY)": _NOT_FORBIDDEN,
        "row, col = place(level, grid, centre, -1, -1, EMPTY)"
        "  ->  row, col = place(level, grid, centre, - 2, -1, EMPTY)": _NOT_FORBIDDEN,
        "row, col = place(level, grid, centre, -1, -1, EMPTY)"
        "  ->  row, col = place(level, grid, centre, -1, - 2, EMPTY)": _NOT_FORBIDDEN,
        "return -1, -1": "there is always an empty cell",
        "slots[0], slots[4] = halved + 4, halved + 8  ->  slots[0], slots[4] = halved + 4, halved - 8": _SECOND_HALF,
        "opposite = (halved + 2) % 4  ->  opposite = (halved - 2) % 4": "of four, two on and two back are the same",
        "slots[5] = opposite + 8  ->  slots[5] = opposite - 8": _SECOND_HALF,
    },
    "observations": {
        "arrays = np.empty(IMAGE, _UINT8), np.empty(1, _FLOAT32), np.empty(1, _INT8), np.empty(1, _INT8)": _SAMPLES,
        "return compiled(write_level, np.zeros(1, OUTCOME), np.zeros(1, LEVEL), 1, TRIPLES, GOAL_VECTORS, *arrays)": (
            _SAMPLES
        ),
        "goals = np.zeros(4, np.int64)[::2]  # a field of records: not contiguous, as an array of one number always is"
        "": _SAMPLES,
        "return np.zeros(1, OUTCOME), np.zeros(1, LEVEL), goals, TRIPLES, GOAL_VECTORS": _SAMPLES,
        "images, vectors, bits = np.zeros((1, *IMAGE), _UINT8), np.zeros((1, 1), _FLOAT32), np.zeros((1, 1), _INT8)"
        "": _SAMPLES,
        "return compiled(write_batch, *_read(), images, vectors, np.zeros(1, _INT64), bits, bits, bits)": _SAMPLES,
        "return compiled(write_flat, *_read(), np.zeros((1, 1), _UINT8))": _SAMPLES,
    },
    "state_check": {
        "low, high = bounds.get(name, (0, 2 ** (8 * field.base.itemsize) - 1))"
        "  ->  low, high = bounds.get(name, ( 1, 2 ** (8 * field.base.itemsize) - 1))": (
            "what has no bounds has one byte or eight, whose lowest is not looked at"
        ),
        "return -1, -1  ->  return +1, -1": _NO_RULE,
        "return -1, -1  ->  return - 2, -1": _NO_RULE,
        "return -1, -1  ->  return -1, - 2": _NO_RULE,
        "return -1  ->  return - 2": "any negative number is that of no rule",
        "words = levels.view(np.uint8).reshape(len(levels), -1)"
        "  ->  words = levels.view(np.uint8).reshape(len(levels), - 2)": _NEGATIVE,
        "return MARGIN < row < grid.shape[0] - 1 - MARGIN and MARGIN < col < grid.shape[1] - 1 - MARGIN"
        "  ->  return MARGIN < row < grid.shape[ 1] - 1 - MARGIN and MARGIN < col < grid.shape[1] - 1 - MARGIN": (
            _SQUARE
        ),
        "n_branches, side = level.n_rooms - 1, grid.shape[0]"
        "  ->  n_branches, side = level.n_rooms - 1, grid.shape[ 1]": _SQUARE,
        "room, depth = branch + 1, 0  ->  room, depth = branch + 1, 1": "there are fewer steps out than rooms",
        "while room > 0 and depth < level.n_rooms:  ->  while room > 0 and depth <= level.n_rooms:": (
            "a step more, which a way out of a tree does not need and a cycle does not end by"
        ),
    },
    "vector_arrays": {
        "flag, numbers = np.zeros(1, _BOOL), [np.zeros(1, _INT64) for _ in range(5)]": _SAMPLES,
        "write_results, np.zeros(1, STEP), np.zeros(1, LEDGER), True, np.zeros(1), flag, flag, flag, *numbers, flag"
        "": _SAMPLES,
        "def __init__(self, turns: Turns, *, flat: bool, copy: bool) -> None:": _NAMED,
        "self, step: Step, *, begins_anew: bool": _NAMED,
        "for env, observation in zip(envs, rows(last, self._parts if self._flat else None), strict=True):"
        "  ->  for env, observation in zip(envs, rows(last, self._parts if self._flat else None), strict=False):": (
            _STRICT
        ),
        "return (dict(zip(parts, of_one, strict=True)) for of_one in zip(*parts.values(), strict=True))"
        "  ->  return (dict(zip(parts, of_one, strict=False)) for of_one in zip(*parts.values(), strict=True))": (
            _STRICT
        ),
        "return (dict(zip(parts, of_one, strict=True)) for of_one in zip(*parts.values(), strict=True))"
        "  ->  return (dict(zip(parts, of_one, strict=True)) for of_one in zip(*parts.values(), strict=False))": (
            _STRICT
        ),
        "for name, values in zip(INFOS, infos, strict=True):"
        "  ->  for name, values in zip(INFOS, infos, strict=False):": _STRICT,
        "numbers = (step.events, step.meta_elapsed > 0, step.illegal_actions, step.lengths, step.shortest)": (
            "an episode ends an option, so that some turns have passed since"
        ),
        "observations = self._write(self._no_step, False, results)": "no episode has ended in what is no step",
    },
    "rollouts": {
        "uniform = (np.float64(mix(level.key + level.n_drawn * GOLDEN) >> np.uint64(11)) + 0.5) * UNIT"
        "  ->  uniform = (np.float64(mix(level.key + level.n_drawn * GOLDEN) >> np.uint64(11)) - 0.5) * UNIT": (
            _LAST_DIGIT
        ),
        "uniform = (np.float64(mix(level.key + level.n_drawn * GOLDEN) >> np.uint64(11)) + 0.5) * UNIT"
        "  ->  uniform = (np.float64(mix(level.key + level.n_drawn * GOLDEN) >> np.uint64(11)) + 1.5) * UNIT": (
            _LAST_DIGIT
        ),
        "if value > best:  ->  if value >= best:": "no two are equal",
        "bits, best, action = mix(policy ^ state_bits(level)), -math.inf, 0"
        "  ->  bits, best, action = mix(policy ^ state_bits(level)), -math.inf, 1": "replaced by the first candidate",
        "scratch, grid, n_steps = levels[:1].copy(), grids[0].copy(), 0"
        "  ->  scratch, grid, n_steps = levels[: 2].copy(), grids[0].copy(), 0": "the first alone is used",
    },
    "oracle": {
        "return -2, terrain, 0, key_cells[:0]  ->  return -2, terrain, 1, key_cells[:0]": _NO_SEARCH,
        "return -2, terrain, 0, key_cells[:0]  ->  return -2, terrain, 0, key_cells[: 1]": _NO_SEARCH,
        "return -1, terrain, 0, key_cells[:0]  ->  return -1, terrain, 1, key_cells[:0]": _NO_SEARCH,
        "return -1, terrain, 0, key_cells[:0]  ->  return -1, terrain, 0, key_cells[: 1]": _NO_SEARCH,
        "is_needed[max(own_room, 0)] = True  ->  is_needed[max(own_room, 1)] = True": _MORE_SEARCHED,
        "chain = np.empty(6, np.int64)  ->  chain = np.empty( 7, np.int64)": _ROOM,
        "if key_cells[other] >= 0 and terrain[key_cells[other]] == FREE:"
        "  ->  if key_cells[other] >= 0 or terrain[key_cells[other]] == FREE:": (
            "keys in rooms that are not entered are counted, too"
        ),
        "A_KEY, A_DOOR, THE_EXIT, OTHER = 0, 1, 2, 3  ->  A_KEY, A_DOOR, THE_EXIT, OTHER = 0, 1, 2, 4": _CODES,
        "A_KEY, A_DOOR, THE_EXIT, OTHER = 0, 1, 2, 3  ->  A_KEY, A_DOOR, THE_EXIT, OTHER = 1, 1, 2, 3": (
            "the table has no doors, and a goal that is no exit and no door is a key"
        ),
        "BLOCKED, FREE, FIRST_KEY, FIRST_DOOR = 0, 1, 2, 8  ->  BLOCKED, FREE, FIRST_KEY, FIRST_DOOR = 0, 1, 2, 9": (
            _CODES
        ),
        "table[constants.EXIT] = THE_EXIT, 0  ->  table[constants.EXIT] = THE_EXIT, 1": "there is one exit",
        "target, is_achieved = key_cells[branch], key_cells[branch] < 0"
        "  ->  target, is_achieved = key_cells[branch], key_cells[branch] <= 0": _CORNER,
        "r = 0 if key_cell < 0 else room_at(level, key_cell // side, key_cell % side)"
        "  ->  r = 0 if key_cell <= 0 else room_at(level, key_cell // side, key_cell % side)": _CORNER,
        "if target < 0:  ->  if target <= 0:": _CORNER,
        "if target < 0:  ->  if target < 1:": _CORNER,
        "return needs[:0], target + 1  ->  return needs[: 1], target + 1": "it is empty there",
        "r = 0 if key_cell < 0 else room_at(level, key_cell // side, key_cell % side)"
        "  ->  r = 0 if key_cell < 1 else room_at(level, key_cell // side, key_cell % side)": _CORNER,
        "if key_cells[other] >= 0 and terrain[key_cells[other]] == FREE:"
        "  ->  if key_cells[other] >= 1 and terrain[key_cells[other]] == FREE:": _CORNER,
        "key_bits = np.zeros(6, np.int64)  ->  key_bits = np.zeros( 7, np.int64)": _ROOM,
        "if key_cells[other] >= 0 and terrain[key_cells[other]] == FREE:"
        "  ->  if key_cells[other] > 0 and terrain[key_cells[other]] == FREE:": _CORNER,
        "target, is_achieved = key_cells[branch], key_cells[branch] < 0"
        "  ->  target, is_achieved = key_cells[branch], key_cells[branch] < 1": _CORNER,
        "goal_room = 0 if is_achieved else room_at(level, target // side, target % side)"
        "  ->  goal_room = 1 if is_achieved else room_at(level, target // side, target % side)": (
            "what is achieved needs no room"
        ),
        "exit_cell = -1": "the exit is always in the grid",
        "for row in range(grid.shape[0]):  ->  for row in range(grid.shape[ 1]):": _SQUARE,
        "while (1 << layer_shift) < 4 * grid.size:  ->  while (1 << layer_shift) <= 4 * grid.size:": "more memory",
        "while head < tail:  ->  while head <= tail:": _REACHED,
        "return needs[:0], -1  ->  return needs[: 1], -1": _NO_SEARCH,
        "layer_shift = 2  ->  layer_shift = 3": _ROOM,
        "layer_shift += 1  ->  layer_shift += 2": _ROOM,
        "while (1 << layer_shift) < 4 * grid.size:  ->  while (1 << layer_shift) < 5 * grid.size:": _ROOM,
        "n_nodes = ((needs.size + 1) << n_keys) << layer_shift"
        "  ->  n_nodes = ((needs.size + 2) << n_keys) << layer_shift": _ROOM,
        "return -2, terrain, 0, key_cells[:0]  ->  return +2, terrain, 0, key_cells[:0]": (
            "cell 2 is a wall, for which is searched in vain"
        ),
        "if r > 0:  ->  if r >= 0:": _MORE_SEARCHED,
        "return -1  ->  return +1": f"keys lie in rooms, and where the agent stands in a doorway {_MORE_SEARCHED}",
        "return -1  ->  return - 2": "any negative number means a doorway",
        "key_cells = np.full(6, -1, np.int64)  ->  key_cells = np.full( 7, -1, np.int64)": "a place more than is used",
        "key_cells = np.full(6, -1, np.int64)  ->  key_cells = np.full(6, - 2, np.int64)": "negative: no cell",
    },
    "encoder": {
        "n_eights = n_features // 8 * 8  ->  n_eights = n_features // 9 * 8": _PARTS,
        "counts = np.zeros((n_features, 256), np.int64)  ->  counts = np.zeros((n_features, 257), np.int64)": _ROOM,
        "counts[k, features[n, k]] += 1  ->  counts[k, features[n, k]] += 2": "twice as many of each",
        "flat = features.reshape(-1, n_features)  ->  flat = features.reshape(- 2, n_features)": _NEGATIVE,
        "_write_rare_rows(flat, offsets, common, n_table_rows, rows.reshape(len(flat), -1), counts.reshape(-1))"
        "  ->  _write_rare_rows(flat, offsets, common, n_table_rows, rows.reshape(len(flat), - 2), counts.reshape(-1))"
        "": _NEGATIVE,
        "_write_rare_rows(flat, offsets, common, n_table_rows, rows.reshape(len(flat), -1), counts.reshape(-1))"
        "  ->  _write_rare_rows(flat, offsets, common, n_table_rows, rows.reshape(len(flat), -1), counts.reshape(- 2))"
        "": _NEGATIVE,
        "stop = offsets[k + 1] if k + 1 < n_features else len(table)"
        "  ->  stop = offsets[k + 1] if k + 2 < n_features else len(table)": (
            "the rows of the last feature are written once more, and then by itself"
        ),
    },
    "recurrent": {
        "_DEPTH = 64  ->  _DEPTH = 65": _PARTS,
        "if t == 0 or (stop - t) * n_rows >= _DEPTH:  ->  if t == 0 or (stop + t) * n_rows >= _DEPTH:": _PARTS,
        "if t == 0 or (stop - t) * n_rows >= _DEPTH:  ->  if t == 0 or (stop - t) / n_rows >= _DEPTH:": _PARTS,
        "if t == 0 or (stop - t) * n_rows >= _DEPTH:  ->  if t == 0 or (stop - t) * n_rows > _DEPTH:": _PARTS,
        "_LIMIT, _QUARTER = np.float32(12), np.float32(0.25)"
        "  ->  _LIMIT, _QUARTER = np.float32( 13), np.float32(0.25)": (
            "tanh is 1 to the last digit there, and the formula holds a little further"
        ),
        "gates[size : 2 * size],  ->  gates[size : 3 * size],": _LONGER,
        "gates[2 * size : 3 * size],  ->  gates[2 * size : 4 * size],": _LONGER,
    },
    "loss": {
        "sums[4] += scale if abs(ratio - 1) > clip else 0.0"
        "  ->  sums[4] += scale if abs(ratio - 1) >= clip else 0.0": "a ratio at the very bound",
    },
    "features": {
        "return len(CLASS_STARTS) + (classes if distance > 0 else -classes)"
        "  ->  return len(CLASS_STARTS) + (classes if distance >= 0 else -classes)": "0 has the class 0 either way",
        "categories = np.zeros((N_GOALS + 1, 2), np.uint8)"
        "  ->  categories = np.zeros((N_GOALS + 2, 2), np.uint8)": _ROW,
        "tiles = np.full(N_GOALS + 1, N_TILES, np.uint8)  ->  tiles = np.full(N_GOALS + 2, N_TILES, np.uint8)": _ROW,
        "is_goal = observation.view.tiles.reshape(-1, N_CELLS) == _GOAL_TILES[observation.goals][:, None]"
        "  ->  is_goal = observation.view.tiles.reshape(- 2, N_CELLS) == _GOAL_TILES[observation.goals][:, None]": (
            _NEGATIVE
        ),
        "return observation.view.tiles.reshape(-1, N_CELLS)"
        "  ->  return observation.view.tiles.reshape(- 2, N_CELLS)": _NEGATIVE,
        "if cells[m, c, 0] > 0:  ->  if cells[m, c, 1] > 0:": _NO_CELL,
        "if cells[m, c, 0] > 0:  ->  if cells[m, c, 0] > 1:": _NO_CELL,
    },
    "adam": {
        "means[i] = mean if abs(mean) > least else nothing  ->  means[i] = mean if abs(mean) >= least else nothing": (
            "the least that is kept, where 1e-30 is as good as nothing"
        ),
    },
    "canonical": {
        "children: list[list[int]] = [[] for _ in range(len(key_rooms) + 1)]"
        "  ->  children: list[list[int]] = [[] for _ in range(len(key_rooms) + 2)]": "an empty list more than rooms",
    },
    "hitting": {
        "rounding = EPSILON * (means[steps.col] + 1 + own[steps.row])"
        "  ->  rounding = EPSILON * (means[steps.col] - 1 + own[steps.row])": _BOUND,
        "rounding = EPSILON * (means[steps.col] + 1 + own[steps.row])"
        "  ->  rounding = EPSILON * (means[steps.col] + 1 - own[steps.row])": _BOUND,
        "error = np.bincount(steps.row, steps.data * rounding * (2 * abs(off_by) + rounding), len(own))"
        "  ->  error = np.bincount(steps.row, steps.data * rounding * (2 * abs(off_by) - rounding), len(own))": _BOUND,
        "is_moment_better = EPSILON * (squares + own**2) < system.solve(error)"
        "  ->  is_moment_better = EPSILON * (squares + own**2) <= system.solve(error)": _BOUND,
        "is_moment_better = EPSILON * (squares + own**2) < system.solve(error)"
        "  ->  is_moment_better = EPSILON * (squares + own*2) < system.solve(error)": _BOUND,
        "rounding = EPSILON * (means[steps.col] + 1 + own[steps.row])"
        "  ->  rounding = EPSILON * (means[steps.col] + 2 + own[steps.row])": _BOUND,
        "error = np.bincount(steps.row, steps.data * rounding * (2 * abs(off_by) + rounding), len(own))"
        "  ->  error = np.bincount(steps.row, steps.data * rounding * ( 3 * abs(off_by) + rounding), len(own))": _BOUND,
        "if fates.unsure[source] or fates.lost[source]:  ->  if fates.unsure[source] and fates.lost[source]:": (
            "the means are infinite there, and their differences are no numbers either way"
        ),
        "reached[fates.unsure] = np.minimum(_system(moves, fates.unsure).solve(into_reached), 1.0)"
        "  ->  reached[fates.unsure] = np.minimum(_system(moves, fates.unsure).solve(into_reached), 2.0)": (
            "elimination without subtraction gave no chance above 1 in 20,000 random walks; it may, by one rounding"
        ),
    },
    "elimination": {
        "lower = np.concatenate((lower, np.empty(len(lower) + n)))"
        "  ->  lower = np.concatenate((lower, np.empty(len(lower) - n)))": _ROOM,
        "upper = np.concatenate((upper, np.empty(len(upper) + n)))"
        "  ->  upper = np.concatenate((upper, np.empty(len(upper) - n)))": _ROOM,
        "row, is_there, has_some = np.zeros(n), np.zeros(n, np.bool_), np.zeros(n // BLOCK + 1, np.bool_)"
        "  ->  row, is_there, has_some = np.zeros(n), np.zeros(n, np.bool_), np.zeros(n * BLOCK + 1, np.bool_)": _ROOM,
        "if n_lower + i > len(lower):  ->  if n_lower + i >= len(lower):": _ROOM,
        "if n_upper + n_after > len(upper):  ->  if n_upper + n_after >= len(upper):": _ROOM,
        "BLOCK = 64  ->  BLOCK = 65": "a size that changes the time alone",
        "if not np.isfinite(self._rates).all() or self._rates.min(initial=1.0) < LEAST_RATE:"
        "  ->  if not np.isfinite(self._rates).all() or self._rates.min(initial= 2.0) < LEAST_RATE:": (
            "what no rate is below"
        ),
        "factors = splu((sp.diags_array(1.0 + np.diff(moves.indptr)) - pattern).tocsc())"
        "  ->  factors = splu((sp.diags_array( 2.0 + np.diff(moves.indptr)) - pattern).tocsc())": (
            "a matrix of the same pattern, also regular"
        ),
        "n, n_lower, n_upper = len(leaving), 0, 0  ->  n, n_lower, n_upper = len(leaving), 1, 0": _FIRST,
        "n, n_lower, n_upper = len(leaving), 0, 0  ->  n, n_lower, n_upper = len(leaving), 0, 1": _FIRST,
        "lower_starts, upper_starts = np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64)"
        "  ->  lower_starts, upper_starts = np.zeros(n + 2, np.int64), np.zeros(n + 1, np.int64)": _ROOM,
        "lower_starts, upper_starts = np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64)"
        "  ->  lower_starts, upper_starts = np.zeros(n + 1, np.int64), np.zeros(n + 2, np.int64)": _ROOM,
        "lower_columns, upper_columns = np.empty(2 * len(weights) + n, np.int64), "
        "np.empty(2 * len(weights) + n, np.int64)"
        "  ->  lower_columns, upper_columns = np.empty( 3 * len(weights) + n, np.int64), "
        "np.empty(2 * len(weights) + n, np.int64)": _ROOM,
        "lower_columns, upper_columns = np.empty(2 * len(weights) + n, np.int64), "
        "np.empty(2 * len(weights) + n, np.int64)"
        "  ->  lower_columns, upper_columns = np.empty(2 * len(weights) + n, np.int64), "
        "np.empty( 3 * len(weights) + n, np.int64)": _ROOM,
        "row, is_there, has_some = np.zeros(n), np.zeros(n, np.bool_), np.zeros(n // BLOCK + 1, np.bool_)"
        "  ->  row, is_there, has_some = np.zeros(n), np.zeros(n, np.bool_), np.zeros(n // BLOCK + 2, np.bool_)": _ROOM,
        "for i in range(len(x) - 1, -1, -1):  ->  for i in range(len(x) - 1, - 2, -1):": (
            "from the last start to the first there is nothing; where a row is divided, too, a test fails"
        ),
        "has_some[block] = False  ->  has_some[block] = True": "an empty block is looked through, and nothing is there",
        "row[j], is_there[j], has_some[j // BLOCK] = 0.0, False, False"
        "  ->  row[j], is_there[j], has_some[j // BLOCK] = 0.0, False, True": "likewise",
        "if j > i:  ->  if j >= i:": "j is another than i here",
        "factors = splu((sp.diags_array(1.0 + np.diff(moves.indptr)) - pattern).tocsc())"
        "  ->  factors = splu((sp.diags_array(1.0 + np.diff(moves.indptr)) + pattern).tocsc())": (
            "a matrix of the same pattern, also regular: the order depends on nothing else"
        ),
    },
    "goal_kernels": {
        "return n_legal > 0  ->  return n_legal >= 0": _ALWAYS,
        "n_legal = 0  ->  n_legal = 1": _ALWAYS,
        "n_legal += 1": "whether it is 0 counts alone",
    },
    "turns": {
        "*,  ->  /,": _NAMED,
        "threads: int = 1,  ->  threads: int = 2,": "results do not depend on it",
        "self._kernel_reward = KERNEL_REWARDS.get(name, OWN_REWARD) if isinstance(name, str) else OWN_REWARD"
        "  ->  self._kernel_reward = KERNEL_REWARDS.get(name, OWN_REWARD) if not isinstance(name, str) else OWN_REWARD"
        "": "the same rewards, written by Python and not by the kernel",
    },
    "options": {
        "*,  ->  /,": _NAMED,
        "novelty_bonus: float = 0.0,  ->  novelty_bonus: float = 1.0,": "everybody who plays with that reward names it",
        "arrays = np.zeros(1, outcome), np.zeros(1, np.int64), np.zeros(1, LEDGER), np.zeros(1, STEP)": _SAMPLES,
        "return compiled(record_turns, *arrays, True, 1, 1, 1, 1.0, True)": _SAMPLES,
        "return compiled(take_goals, np.zeros((1, 1), bool), np.zeros(1, LEDGER), np.zeros(1, np.int64))": _SAMPLES,
    },
    "sampling": {
        "if masks[env, action] and logits[env, action] > highest:"
        "  ->  if masks[env, action] and logits[env, action] >= highest:": "the same number either way",
        "chosen = -1": "replaced, as each row has a legal action",
        "highest = legal.max(axis=-1)  ->  highest = legal.max(axis=+1)": _LAST,
        "totals = np.log(np.exp(legal - highest[:, None]).sum(axis=-1))"
        "  ->  totals = np.log(np.exp(legal - highest[:, None]).sum(axis=+1))": _LAST,
        "return np.where(masks, logits, -np.inf).argmax(axis=-1)"
        "  ->  return np.where(masks, logits, -np.inf).argmax(axis=+1)": _LAST,
    },
}
