"""Impossible states of environments raise InputError before a kernel sees them."""

import numpy as np
import pytest

from hierroom.goals import NAMED_GRAPHS, GoalGraph
from hierroom.support.errors import InputError
from hierroom.worlds.escape_room import constants
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.layout import LEVEL, State
from hierroom.worlds.escape_room.state_check import RULES, check_state, level_bounds

SEVEN_ROOMS = GoalGraph((0, 0, 1, 0, 2, 4), 5)
MEMORIES = ("visited", "explored", "doorways")


def begun(n=2, size=13):
    return Engine([NAMED_GRAPHS["f"]], n, size=size, seed=3, drop_key=True, memories=MEMORIES)


@pytest.mark.parametrize("size", [11, 19, 63])
@pytest.mark.parametrize("drop_key", [False, True])
def test_every_reached_state_is_accepted(size, drop_key):
    graphs, rng = [*NAMED_GRAPHS.values(), SEVEN_ROOMS], np.random.default_rng(size)
    world = Engine(graphs, 32, size=size, drop_key=drop_key, max_steps=40, memories=MEMORIES)
    for _ in range(200):
        if rng.random() < 0.5:  # otherwise too few environments pick up keys
            for env in range(0, 32, 8):
                world._state.levels["direction"][env] = rng.integers(4)
        world.step(rng.choice(5 + drop_key, 32, p=[0.4, 0.1, 0.1, 0.2, 0.2 - 0.05 * drop_key, 0.05][: 5 + drop_key]))
        check_state(world.get_state())


def test_ended_state_at_the_last_step_is_valid():
    state = begun().get_state()
    state.levels["steps"][1], state.levels["has_ended"][1] = state.levels["max_steps"][1], True
    check_state(state)


@pytest.mark.parametrize("name", level_bounds(13))
def test_field_outside_its_bounds_raises_input_error(name):
    """Try one beyond each bound and the limits of the dtype, in all numbers of a field and in the last alone."""
    world, (low, high) = begun(), level_bounds(13)[name]
    info = np.iinfo(LEVEL[name].base)
    for number in (low - 1, high + 1, info.min, info.max):
        if low <= number <= high or not info.min <= number <= info.max:
            continue
        for place in ((...,), tuple(size - 1 for size in LEVEL[name].shape)):
            state, said = world.get_state(), rf"^levels\.{name} must be at (least|most) -?\d+, not {number} \(at"
            state.levels[name][(1, *place)] = number
            with pytest.raises(InputError, match=said):
                world.set_state(state)


def test_level_bounds_cover_all_but_flags_and_random_numbers():
    assert set(LEVEL.names) - level_bounds(13).keys() == {"key", "n_drawn", "can_drop", "has_ended"}


def test_invalid_flag_byte_raises_input_error():
    state = begun().get_state()
    state.levels.view(np.uint8).reshape(2, -1)[1, LEVEL.fields["has_ended"][1]] = 2
    with pytest.raises(InputError, match=r"^levels.has_ended must be True or False everywhere$"):
        check_state(state)


def exit_elsewhere(level, grid):
    grid[grid == constants.EXIT] = constants.EMPTY
    grid[level.rectangles[0][0], level.rectangles[0][1]] = constants.EXIT


def key_twice(level, grid):
    top, left, bottom, right = level.rectangles[0]
    inside = grid[top : bottom + 1, left : right + 1]
    row, col = np.argwhere(inside == constants.EMPTY)[0]
    inside[row, col] = constants.KEY + level.colours[0]


BREAK = {
    "the goal graph is a tree of its rooms": lambda level, grid: level.key_rooms.__setitem__(0, 1),
    "branches is the inverse of colours": lambda level, grid: level.colours.__setitem__(0, level.colours[1]),
    "walls surround the grid": lambda level, grid: grid.__setitem__((5, 9), constants.EMPTY),
    "rooms lie inside the walls": lambda level, grid: level.rectangles[1].__setitem__(2, 22),
    "keys, doors and what was found are those of the rooms": lambda level, grid: setattr(level, "found", 63),
    "a key that is held and a door that is open were found": lambda level, grid: setattr(level, "doors", 1),
    "doors_at names the cell of each door": lambda level, grid: level.doors_at[0].__setitem__(0, 0),
    "keys_at names the cell of each key": lambda level, grid: level.keys_at[0].__setitem__(1, 0),
    "the exit is where it is said to be": exit_elsewhere,
    "the grid holds nothing else": key_twice,
    "the agent stands on floor": lambda level, grid: grid.__setitem__((level.row, level.col), constants.WALL),
    "the bag holds the keys that are held, each once": lambda level, grid: setattr(level, "bag_size", 6),
    "the key to drop is the last one picked up with a locked door": lambda level, grid: setattr(level, "carried", 2),
    "has_ended is True at the exit and after the last step only": lambda level, grid: setattr(level, "has_ended", True),
    "all doors of a level that is drawn are opened from its first room": lambda level, grid: setattr(
        level, "door_rooms", 1
    ),
}


@pytest.mark.parametrize("rule", RULES)
def test_broken_rule_raises_input_error(rule):
    state = begun().get_state()
    BREAK[rule](state.levels[1], state.grids[1])
    with pytest.raises(InputError, match=f"^invalid state in environment 1, which breaks the rule: {rule}$"):
        begun().set_state(state)


CYCLES = [
    *((branch, branch + 1, None) for branch in range(6)),
    *((branch, other + 1, (other, branch + 1)) for branch in range(6) for other in range(branch)),
]


@pytest.mark.parametrize(("branch", "room", "and_back"), CYCLES)
def test_unreachable_key_raises_input_error_in_any_room(branch, room, and_back):
    """The key is in the room that it opens, or two keys are in each other's rooms."""
    state = Engine([SEVEN_ROOMS], size=19).get_state()
    check_state(state)
    state.levels["key_rooms"][0, branch] = room
    if and_back is not None:
        state.levels["key_rooms"][0, and_back[0]] = and_back[1]
    with pytest.raises(InputError, match=RULES[0]):
        check_state(state)


@pytest.mark.parametrize("things", ["keys_at", "doors_at"])
def test_agent_on_key_or_locked_door_raises_input_error(things):
    state, colours = begun(20).get_state(), set()
    for env, branch in np.ndindex(20, 2):
        wrong = state[env].copy()
        wrong.levels["row"], wrong.levels["col"] = state.levels[things][env, branch]
        colours.add(int(state.levels["colours"][env, branch]))
        with pytest.raises(InputError, match=RULES[10]):
            check_state(wrong)
    assert colours == set(range(6))


@pytest.mark.parametrize("name", ["keys", "doors", "found"])
def test_bits_of_missing_rooms_raise_input_error(name):
    state = begun().get_state()
    state.levels[name][1] |= 1 << state.levels["n_rooms"][1] - 1
    with pytest.raises(InputError, match=RULES[4]):
        check_state(state)


@pytest.mark.parametrize("n_rooms", [2, 3, 6])
def test_key_or_exit_in_missing_room_raises_input_error(n_rooms):
    graph = GoalGraph((0,) * (n_rooms - 1), n_rooms - 1)
    for name, place in (("exit_room", ()), ("key_rooms", (n_rooms - 2,))):
        state = Engine([graph], size=19).get_state()
        state.levels[name][(0, *place)] = n_rooms
        with pytest.raises(InputError, match=RULES[0]):
            check_state(state)


@pytest.mark.parametrize("row", [0, 5, 12, 17, 22])
@pytest.mark.parametrize("col", [0, 5, 17, 22])
@pytest.mark.parametrize("is_turned", [False, True])
def test_gap_in_the_outer_wall_raises_input_error(row, col, is_turned):
    row, col = (col, row) if is_turned else (row, col)
    state = begun().get_state()
    state.grids[1, row, col] = constants.EMPTY
    with pytest.raises(InputError, match=f"^invalid state in environment 1, .*{RULES[2]}$"):
        check_state(state)


@pytest.mark.parametrize(("side", "number"), [(0, 5), (1, 5), (2, 17), (3, 17), (0, 0), (1, 0), (2, 22), (3, 22)])
def test_room_outside_the_walls_raises_input_error(side, number):
    for room in range(4):
        state = begun().get_state()
        state.levels["rectangles"][1, room, side] = number
        with pytest.raises(InputError, match=RULES[3]):
            check_state(state)


@pytest.mark.parametrize(("first", "last"), [(0, 2), (1, 3)])
def test_room_must_be_at_least_one_cell_wide(first, last):
    state = begun().get_state()
    rectangle = state.levels["rectangles"][1, 1]
    rectangle[last] = rectangle[first]
    check_state(state)
    rectangle[last] -= 1
    with pytest.raises(InputError, match=RULES[3]):
        check_state(state)


@pytest.mark.parametrize("branch", range(3))
def test_bag_must_contain_each_held_key_once(branch):
    state = begun().get_state()
    level, grid = state.levels[1], state.grids[1]
    grid[tuple(level["keys_at"][branch])] = constants.EMPTY
    level["keys"] = level["found"] = 1 << branch
    level["bag"], level["bag_size"], level["carried"] = branch, 1, branch
    check_state(state)
    for wrong in (0, 2):
        level["bag_size"] = wrong
        with pytest.raises(InputError, match=RULES[11]):
            check_state(state)


@pytest.mark.parametrize(
    ("grids", "levels", "said"),
    [
        (np.ones((2, 23, 23)), None, "grids must be an array of uint8 and shape"),
        (np.ones((2, 23, 22), np.uint8), None, "grids must be an array of uint8 and shape"),
        (np.ones((2, 23), np.uint8), None, "the grids of a state must be an array"),
        (np.ones((2, 3, 3), np.uint8), None, "the grids of a state must be an array"),
        (None, np.zeros(2), "the levels of a state must be an array"),
        (None, np.zeros(3, LEVEL), "grids must be an array of uint8 and shape"),
        (np.full((2, 23, 23), 255, np.uint8), None, "grids must be at most 21, not 255 \\(at"),
        (None, np.zeros(2, LEVEL), "levels.max_steps must be at least 1, not 0"),
    ],
)
def test_arrays_of_wrong_dtype_or_shape_raise_input_error(grids, levels, said):
    world, state = begun(), begun().get_state()
    wrong = State(state.grids if grids is None else grids, state.levels if levels is None else levels)
    with pytest.raises(InputError, match=f"^{said}"):
        world.set_state(wrong)


def test_refused_state_changes_nothing():
    world, before = begun(), begun().get_state()
    wrong = begun(2).get_state()
    wrong.levels["row"][1] = 10**6
    with pytest.raises(InputError):
        world.set_state(wrong)
    assert (world.state.grids == before.grids).all()
    assert (world.state.levels == before.levels).all()


@pytest.mark.parametrize("name", ["seed", "index", "episode", "key", "n_drawn"])
def test_largest_allowed_number_is_accepted(name):
    state = begun().get_state()
    state.levels[name] = level_bounds(13).get(name, (0, 2**64 - 1))[1]
    check_state(state)


def test_level_bounds_of_a_grid_of_fifteen():
    """A grid of 15 cells and margins of 5 on each side, with the numbers written out."""
    large = 2**31 - 1
    of_cells = dict.fromkeys(("rectangles", "doors_at", "keys_at", "exit_at", "divider", "doorways"), (0, 24))
    expected = {"seed": (0, 2**63 - 1), "index": (0, 2**63 - 1), "episode": (0, 2**63 - 2), "max_steps": (1, large)}
    expected |= {"remembers": (0, 7), "split": (0, 2), "n_rooms": (2, 7), "exit_room": (1, 6), "key_rooms": (0, 6)}
    expected |= {"map": (0, 0), "door_rooms": (0, 6)}
    expected |= {"colours": (0, 5), "branches": (0, 5), **of_cells, "row": (6, 18), "col": (6, 18)}
    expected |= {"direction": (0, 3), "steps": (0, large), "keys": (0, 63), "doors": (0, 63), "found": (0, 63)}
    expected |= {"opened_at": (0, large), "seen": (0, 2**13 - 1), "visited": (0, 2**15 - 1), "explored": (0, 2**15 - 1)}
    assert level_bounds(15) == expected | {"bag": (0, 5), "bag_size": (0, 6), "carried": (-1, 5)}
