"""The oracle: its paths work, no shorter ones exist, and unreachable goals raise InputError."""

import numpy as np
import pytest
from exhaustive_search import steps_to_goals

from hierroom.goals import EXIT_GOAL, NAMED_GRAPHS, GoalGraph
from hierroom.support.errors import InputError
from hierroom.worlds.escape_room import constants
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.layout import NO_MAPS
from hierroom.worlds.escape_room.oracle import shortest_actions, shortest_lengths, solve_levels

EXIT_AMONG_KEYS = GoalGraph((0, 1), 1)
"""A key is in the exit's room: its shortest path may have to go around the exit."""
SIX_KEYS = GoalGraph((0, 0, 0, 0, 0, 0), 6)
"""All six keys are in the centre room."""
GRAPHS = [*NAMED_GRAPHS.values(), GoalGraph((0, 0, 1, 0, 2, 4), 5), SIX_KEYS, EXIT_AMONG_KEYS]


def check_against_search(world: Engine, can_drop: bool) -> None:
    found = steps_to_goals(world.state, can_drop)
    level = world.state.levels[0]
    for goal in range(13):
        length = shortest_lengths(world.state, goal)[0]
        branch = level.branches[goal % 6]
        if goal == EXIT_GOAL:
            assert length == found[goal]
        elif branch >= level.n_rooms - 1:
            assert length == -1
            assert goal not in found
        elif (level.doors >> branch) & 1 or (goal < 6 and (level.keys >> branch) & 1):
            assert length == 0
        else:
            assert length == found[goal], (goal, length)


def wander(world: Engine, steps: int, rng: np.random.Generator) -> None:
    """Act at random, and half of the time as the oracle would for a random goal, so that something happens."""
    for _ in range(steps):
        goals = rng.integers(12, size=len(world))
        actions = rng.integers(6, size=len(world))
        for n in np.flatnonzero(rng.random(len(world)) < 0.5):
            if shortest_lengths(world.state[n], goals[n])[0] > 0:
                actions[n] = shortest_actions(world.state[n], goals[n])[0]
        world.step_within_episode(actions)


@pytest.mark.parametrize("letter", ["a", "b", "c", "d"])
@pytest.mark.parametrize("index", range(4))
def test_breadth_first_search_finds_no_shorter_path(letter, index):
    world = Engine([NAMED_GRAPHS[letter]], size=11, seed=1, first_index=index, drop_key=True)
    check_against_search(world, can_drop=False)
    wander(world, 40, np.random.default_rng(index))
    check_against_search(world, can_drop=False)


def test_paths_to_keys_go_around_the_exit():
    n_around = 0
    for index in range(10, 18):
        world = Engine([EXIT_AMONG_KEYS], size=11, seed=1, first_index=index)
        check_against_search(world, can_drop=False)
        key = world.state.levels[0].colours[1]
        free, length = world.get_state(), np.empty(1, np.int64)
        free.levels["exit_at"] = 0  # in the outer wall: an impossible level, for the kernel alone
        solve_levels(free.levels, NO_MAPS.rooms, free.grids.shape[1], np.array([0]), np.array([key]), length)
        n_around += length[0] < shortest_lengths(world.state, key)[0]
    assert n_around > 0


def test_dropping_keys_shortens_no_path():
    world = Engine([NAMED_GRAPHS["a"]], size=11, seed=3, drop_key=True)
    check_against_search(world, can_drop=True)
    wander(world, 20, np.random.default_rng(0))
    check_against_search(world, can_drop=True)


@pytest.mark.parametrize("graph", GRAPHS, ids=lambda graph: graph.name)
@pytest.mark.parametrize("size", [11, 19, 31])
def test_paths_reach_goals_in_their_stated_length(graph, size):
    levels = Engine([graph], 10, size=size, seed=5)
    for n in range(len(levels)):
        for goal in range(13):
            world = Engine([graph], size=size, seed=5, first_index=n)
            length = shortest_lengths(world.state, goal)[0]
            if length < 0:
                assert world.state.levels[0].branches[goal % 6] >= graph.n_rooms - 1
                continue
            path = shortest_actions(world.state, goal)
            assert len(path) == length > 0
            events = [int(world.step_within_episode(path[[t]])[0].achieved).bit_length() - 1 for t in range(length)]
            assert events[-1] == goal
            assert goal not in events[:-1]
            assert world.outcomes[0].terminated == (goal == EXIT_GOAL)


def test_one_step_shortens_the_path_by_at_most_one():
    rng = np.random.default_rng(0)
    world = Engine(GRAPHS, 100, seed=2, drop_key=True)
    lengths = shortest_lengths(world.state)
    for _ in range(300):
        before = lengths
        wander(world, 1, rng)
        lengths = shortest_lengths(world.state)
        assert (before - lengths).max() <= 1
        assert (lengths > 0).sum() == (~world.state.levels["has_ended"]).sum()
    assert (world.state.levels["found"] & ~world.state.levels["keys"]).any()  # keys were dropped
    assert world.state.levels["doors"].any()


@pytest.mark.parametrize("graph", NAMED_GRAPHS.values(), ids=lambda graph: graph.name)
def test_rest_of_a_shortest_path_is_shortest(graph):
    """Check after each key taken and each door opened on the path, so also with inner doors open."""
    world = Engine([graph], size=11 if graph.n_rooms < 4 else 13, seed=5)
    path = shortest_actions(world.state)
    for done, action in enumerate(path[:-1], start=1):
        outcome = world.step_within_episode(np.array([action]))[0]
        if outcome.achieved:
            assert shortest_lengths(world.state) == len(path) - done


def test_shortest_lengths_takes_a_goal_per_environment():
    world = Engine([NAMED_GRAPHS["c"]], 30, seed=4)
    doors = 6 + world.state.levels["colours"][:, 1]
    together = shortest_lengths(world.state, doors)
    assert together.tolist() == [shortest_lengths(world.state[n], doors[n])[0] for n in range(30)]
    assert (together > shortest_lengths(world.state, doors - 6)).all()


@pytest.mark.parametrize("graph", [NAMED_GRAPHS["a"], NAMED_GRAPHS["g"]], ids=lambda graph: graph.name)
def test_achieved_goal_needs_no_action(graph):
    world = Engine([graph], seed=6)
    level = world.state.levels[0]
    n_branches, colours = len(graph.key_rooms), level.colours.copy()
    seen = set()
    for action in shortest_actions(world.state):
        for branch in range(n_branches):
            for goal, achieved in ((colours[branch], level.keys), (6 + colours[branch], level.doors)):
                is_achieved = bool(achieved >> branch & 1)
                assert (shortest_lengths(world.state, goal)[0] == 0) == is_achieved
                seen.add((goal, is_achieved))
        world.step_within_episode(np.array([action]))
    assert len(seen) > 2 * n_branches
    assert shortest_lengths(world.state)[0] == 0
    assert len(shortest_actions(world.state)) == 0
    assert shortest_lengths(world.state, colours[0])[0] == -1  # the episode has ended


@pytest.mark.parametrize("exit_room", [1, 2])
def test_keys_behind_each_other_are_out_of_reach(exit_room):
    """No play leads to such a state, but a user can make one."""
    state = Engine([GoalGraph((0, 0), exit_room)], size=11).get_state()
    level, grid = state.levels[0], state.grids[0]
    for branch, room in ((0, 2), (1, 1)):
        grid[tuple(level["keys_at"][branch])] = constants.EMPTY
        top, left, bottom, right = level["rectangles"][room]
        empty = np.argwhere(grid[top : bottom + 1, left : right + 1] == constants.EMPTY)[0] + (top, left)
        level["keys_at"][branch], grid[tuple(empty)] = empty, constants.KEY + level["colours"][branch]
    goals = [EXIT_GOAL, *(first + level["colours"][branch] for first in (0, 6) for branch in (0, 1))]
    assert [int(shortest_lengths(state, goal)[0]) for goal in goals] == [-1] * 5
    for goal in goals:
        with pytest.raises(InputError, match="its key is out of reach"):
            shortest_actions(state, int(goal))


def test_invalid_input_raises_input_error():
    world = Engine([NAMED_GRAPHS["a"]], 2)
    for goals in (13, -1, 0.5, [0, 13]):
        with pytest.raises(InputError, match="goals must be whole numbers from 0 to 12"):
            shortest_lengths(world.state, goals)
    with pytest.raises(InputError, match="one environment, but the state holds 2"):
        shortest_actions(world.state)
    for goal in (13, -1, "exit"):
        with pytest.raises(InputError, match="whole number from 0 to 12, not"):
            shortest_actions(world.state[0], goal)  # type: ignore[arg-type]
    missing = 6 + int(world.state.levels[0].colours[1])
    with pytest.raises(InputError, match="door cannot be achieved: it does not exist"):
        shortest_actions(world.state[0], missing)
