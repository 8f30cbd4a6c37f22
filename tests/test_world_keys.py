"""The rules of keys and doors, one by one, in rooms where the agent is put before what matters."""

import numpy as np

from hierroom.goals import EXIT_GOAL, NAMED_GRAPHS
from hierroom.world import kernels, tiles
from hierroom.world.kernels import DROP, EMPTY, EXIT, FORWARD, KEY, LEFT, LOCKED_DOOR, OPEN, OPEN_DOOR, PICKUP, WALL
from hierroom.world.world import World


def face(batch: World, tile: int) -> None:
    """Put the agent on a free cell with the tile ahead."""
    room, grid = batch.state.levels[0], batch.state.grids[0]
    for row, col in np.argwhere(grid == tile):
        for direction in range(4):
            here = row - kernels.ROW_STEP[direction], col - kernels.COL_STEP[direction]
            if max(here) < len(grid) and grid[here] == EMPTY:
                room.row, room.col, room.direction = *here, direction
                return
    raise AssertionError(f"no free cell beside a tile {tile}")


def act(batch: World, action: int) -> np.record:
    return batch.step_within_episode([action])[0]


def fetch(batch: World, colour: int) -> np.record:
    face(batch, KEY + colour)
    return act(batch, PICKUP)


def test_keys_collect_and_the_last_useful_one_is_shown():
    batch = World([NAMED_GRAPHS["e"]], seed=13, drop_key=True)
    first, second, third = batch.state.levels[0].colours[:3]
    for count, colour in enumerate((second, first, third), start=1):
        outcome = fetch(batch, colour)
        assert (outcome.event, outcome.is_first, outcome.reward) == (colour, True, 0)
        assert batch.state.levels[0].bag_size == count
        assert outcome.tiles[3, 6] == KEY + colour
        assert not (batch.state.grids == KEY + colour).any()
    # A key whose door is open is of no more use: the one before it is shown.
    face(batch, LOCKED_DOOR + third)
    outcome = act(batch, OPEN)
    assert (outcome.event, outcome.is_first) == (6 + third, True)
    assert outcome.tiles[3, 6] == KEY + first
    assert outcome.tiles[3, 5] == OPEN_DOOR + third
    observation = tiles.encode(batch.outcomes["tiles"])[0]
    assert observation[3, 5].tolist() == [tiles.DOOR_ID, third, 1]
    # Open doors stay open.
    face(batch, OPEN_DOOR + third)
    assert act(batch, OPEN).event == -1
    assert (batch.state.grids == OPEN_DOOR + third).sum() == 1


def test_drop_puts_down_the_last_key_whose_door_is_locked():
    batch = World([NAMED_GRAPHS["e"]], seed=14, drop_key=True)
    first, second, third = batch.state.levels[0].colours[:3]
    for colour in (first, second, third):
        fetch(batch, colour)
    face(batch, LOCKED_DOOR + third)
    act(batch, OPEN)
    for colour, next_shown in ((second, KEY + first), (first, EMPTY)):
        face(batch, EMPTY)
        outcome = act(batch, DROP)
        assert outcome.event == -1
        assert (outcome.tiles[3, 5], outcome.tiles[3, 6]) == (KEY + colour, next_shown)
        assert (batch.state.grids == KEY + colour).sum() == 1
    face(batch, EMPTY)
    before = batch.state.grids.copy()
    act(batch, DROP)  # the third key is in hand, but its door is open
    assert (batch.state.grids == before).all()
    assert batch.state.levels[0].bag_size == 1
    # What was dropped can be picked up again, and that is no first time; its door can be opened.
    outcome = fetch(batch, second)
    assert (outcome.event, outcome.is_first) == (second, False)
    face(batch, LOCKED_DOOR + first)
    assert act(batch, OPEN).event == -1
    face(batch, LOCKED_DOOR + second)
    assert act(batch, OPEN).event == 6 + second


def test_keys_are_dropped_on_free_cells_only():
    batch = World([NAMED_GRAPHS["e"]], seed=15, drop_key=True)
    first, second, third = batch.state.levels[0].colours[:3]
    fetch(batch, first)
    fetch(batch, second)
    face(batch, LOCKED_DOOR + first)
    act(batch, OPEN)
    before = batch.state.grids.copy()
    for tile in (WALL, EXIT, KEY + third, LOCKED_DOOR + third, OPEN_DOOR + first):
        face(batch, tile)
        act(batch, DROP)
        assert (batch.state.grids == before).all()
        assert batch.state.levels[0].bag_size == 2


def test_without_drop_the_action_only_costs_a_step():
    batch = World([NAMED_GRAPHS["a"]], seed=16)
    assert batch.n_actions == 5
    fetch(batch, batch.state.levels[0].colours[0])
    face(batch, EMPTY)
    for action in (DROP, -1, 99):
        before, steps = batch.state.grids.copy(), batch.state.levels[0].steps
        act(batch, action)
        assert (batch.state.grids == before).all()
        assert batch.state.levels[0].steps == steps + 1


def test_a_door_needs_its_own_key():
    batch = World([NAMED_GRAPHS["b"]], seed=17)
    first, second = batch.state.levels[0].colours[:2]
    face(batch, LOCKED_DOOR + first)
    assert act(batch, OPEN).event == -1
    fetch(batch, second)
    face(batch, LOCKED_DOOR + first)
    assert act(batch, OPEN).event == -1
    assert act(batch, FORWARD).event == -1
    assert batch.state.grids[0][batch.state.levels[0].row, batch.state.levels[0].col] == EMPTY


def test_what_was_seen_is_remembered_for_the_episode():
    batch = World([NAMED_GRAPHS["b"]], seed=18)
    room = batch.state.levels[0]
    for goal in (room.colours[0], 6 + room.colours[1]):
        assert not (room.seen >> goal) & 1
        face(batch, (KEY + goal) if goal < 6 else (LOCKED_DOOR + goal - 6))
        act(batch, -1)
        assert (room.seen >> goal) & 1
        face(batch, EXIT)
        act(batch, LEFT)
        act(batch, LEFT)
        assert (room.seen >> goal) & 1
        assert (room.seen >> EXIT_GOAL) & 1
    batch.reset()
    shown = set(batch.outcomes["tiles"][0].ravel().tolist())
    assert bool((batch.state.levels[0].seen >> EXIT_GOAL) & 1) == (EXIT in shown)
