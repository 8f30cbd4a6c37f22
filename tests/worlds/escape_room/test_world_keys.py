"""The rules of keys and doors, one by one; the tests place the agent in front of a key or door."""

import numpy as np

from hierroom.goals import EXIT_GOAL, NAMED_GRAPHS
from hierroom.worlds.escape_room import constants, tiles
from hierroom.worlds.escape_room.constants import (
    DROP,
    EMPTY,
    EXIT,
    FORWARD,
    KEY,
    LEFT,
    LOCKED_DOOR,
    OPEN,
    OPEN_DOOR,
    PICKUP,
    WALL,
)
from hierroom.worlds.escape_room.engine import Engine


def face(world: Engine, tile: int) -> None:
    level, grid = world._state.levels[0], world._state.grids[0]
    for row, col in np.argwhere(grid == tile):
        for direction in range(4):
            here = row - constants.ROW_STEP[direction], col - constants.COL_STEP[direction]
            if max(here) < len(grid) and grid[here] == EMPTY:
                level.row, level.col, level.direction = *here, direction
                return
    raise AssertionError(f"no free cell next to a tile {tile}")


def act(world: Engine, action: int) -> np.record:
    return world.step_within_episode([action])[0]


def fetch(world: Engine, colour: int) -> np.record:
    face(world, KEY + colour)
    return act(world, PICKUP)


def test_keys_collect_and_the_last_useful_key_is_shown():
    world = Engine([NAMED_GRAPHS["e"]], seed=13, drop_key=True)
    first, second, third = world.state.levels[0].colours[:3]
    for count, colour in enumerate((second, first, third), start=1):
        outcome = fetch(world, colour)
        assert (outcome.achieved, outcome.n_first, outcome.reward) == (1 << colour, 1, 0)
        assert world.state.levels[0].bag_size == count
        assert outcome.tiles[3, 6] == KEY + colour
        assert not (world.state.grids == KEY + colour).any()
    # A key is useless once its door is open: the key before it is shown.
    face(world, LOCKED_DOOR + third)
    outcome = act(world, OPEN)
    assert (outcome.achieved, outcome.n_first) == (1 << 6 + third, 1)
    assert outcome.tiles[3, 6] == KEY + first
    assert outcome.tiles[3, 5] == OPEN_DOOR + third
    observation = tiles.encode(world.outcomes["tiles"])[0]
    assert observation[3, 5].tolist() == [tiles.DOOR_ID, third, 1]
    # Open doors stay open.
    face(world, OPEN_DOOR + third)
    assert act(world, OPEN).achieved == 0
    assert (world.state.grids == OPEN_DOOR + third).sum() == 1


def test_drop_puts_down_the_last_useful_key():
    world = Engine([NAMED_GRAPHS["e"]], seed=14, drop_key=True)
    first, second, third = world.state.levels[0].colours[:3]
    for colour in (first, second, third):
        fetch(world, colour)
    face(world, LOCKED_DOOR + third)
    act(world, OPEN)
    for colour, next_shown in ((second, KEY + first), (first, EMPTY)):
        face(world, EMPTY)
        outcome = act(world, DROP)
        assert outcome.achieved == 0
        assert (outcome.tiles[3, 5], outcome.tiles[3, 6]) == (KEY + colour, next_shown)
        assert (world.state.grids == KEY + colour).sum() == 1
    face(world, EMPTY)
    before = world.state.grids.copy()
    act(world, DROP)  # the third key is in hand, but its door is open
    assert (world.state.grids == before).all()
    assert world.state.levels[0].bag_size == 1
    # A dropped key can be picked up again, which does not count as a first; then its door can be opened.
    outcome = fetch(world, second)
    assert (outcome.achieved, outcome.n_first) == (1 << second, 0)
    face(world, LOCKED_DOOR + first)
    assert act(world, OPEN).achieved == 0
    face(world, LOCKED_DOOR + second)
    assert act(world, OPEN).achieved == 1 << 6 + second


def test_keys_are_dropped_on_free_cells_only():
    world = Engine([NAMED_GRAPHS["e"]], seed=15, drop_key=True)
    first, second, third = world.state.levels[0].colours[:3]
    fetch(world, first)
    fetch(world, second)
    face(world, LOCKED_DOOR + first)
    act(world, OPEN)
    before = world.state.grids.copy()
    for tile in (WALL, EXIT, KEY + third, LOCKED_DOOR + third, OPEN_DOOR + first):
        face(world, tile)
        act(world, DROP)
        assert (world.state.grids == before).all()
        assert world.state.levels[0].bag_size == 2


def test_drop_without_drop_key_only_costs_a_step():
    world = Engine([NAMED_GRAPHS["a"]], seed=16)
    assert world.n_actions == 5
    fetch(world, world.state.levels[0].colours[0])
    face(world, EMPTY)
    for action in (DROP, -1, 99):
        before, steps = world.state.grids.copy(), world.state.levels[0].steps
        act(world, action)
        assert (world.state.grids == before).all()
        assert world.state.levels[0].steps == steps + 1


def test_a_door_needs_its_own_key():
    world = Engine([NAMED_GRAPHS["b"]], seed=17)
    first, second = world.state.levels[0].colours[:2]
    face(world, LOCKED_DOOR + first)
    assert act(world, OPEN).achieved == 0
    fetch(world, second)
    face(world, LOCKED_DOOR + first)
    assert act(world, OPEN).achieved == 0
    assert act(world, FORWARD).achieved == 0
    assert world.state.grids[0][world.state.levels[0].row, world.state.levels[0].col] == EMPTY


def test_opened_at_is_the_step_of_opening():
    world = Engine([NAMED_GRAPHS["b"]], seed=17)
    level = world.state.levels[0]
    fetch(world, level.colours[1])
    act(world, LEFT)
    face(world, LOCKED_DOOR + level.colours[1])
    assert act(world, OPEN).achieved == 1 << 6 + level.colours[1]
    assert level.opened_at.tolist() == [0, 3, 0, 0, 0, 0]


def test_seen_goals_are_remembered_until_the_episode_ends():
    world = Engine([NAMED_GRAPHS["b"]], seed=18)
    level = world.state.levels[0]
    for goal in (level.colours[0], 6 + level.colours[1]):
        assert not (level.seen >> goal) & 1
        face(world, (KEY + goal) if goal < 6 else (LOCKED_DOOR + goal - 6))
        assert act(world, -1).is_discovery
        assert not act(world, -1).is_discovery
        assert (level.seen >> goal) & 1
        face(world, EXIT)
        act(world, LEFT)
        act(world, LEFT)
        assert (level.seen >> goal) & 1
        assert (level.seen >> EXIT_GOAL) & 1
    world.reset()
    shown = set(world.outcomes["tiles"][0].ravel().tolist())
    assert bool((world.state.levels[0].seen >> EXIT_GOAL) & 1) == (EXIT in shown)
