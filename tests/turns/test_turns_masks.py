"""Legal goals under each goal mask, and rewards for pursuing no goal."""

import numpy as np
import pytest
from turns_helpers import achieve, goal_ids, make, open_goals, well_or_wildly

from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, N_GOALS, GoalGraph, enumerate_graphs
from hierroom.goals import N_GOALS as NO_GOAL_ACTION
from hierroom.worlds.escape_room.constants import EXIT, KEY, OPEN_DOOR, WALL

SEVEN_ROOMS = GoalGraph((0, 0, 1, 0, 2, 4), 5)
BOTH = ("meta_0", "controller_0")


def legal(turns, mask):
    situation = turns.situation(np.array([0]))
    return {int(goal) for goal in np.flatnonzero(situation.goals_by(mask)[0])}


def test_goal_masks_along_a_solution_of_graph_d():
    """Keys of rooms 1 and 2 in the centre, that of room 3 in room 1; the exit in room 2."""
    turns = make("d", seed=3, size=19)
    everything = {"k1", "k2", "k3", "d1", "d2", "d3", "x"}
    for done, reachable in [
        ([], {"k1", "k2"}),
        (["k1"], {"d1", "k2"}),
        (["k1", "d1"], {"k2", "k3"}),
        (["k1", "d1", "k3"], {"k2", "d3"}),
        (["k1", "d1", "k3", "k2"], {"d2", "d3"}),
        (["k1", "d1", "k3", "k2", "d2"], {"x", "d3"}),
        (["k1", "d1", "k3", "k2", "d2", "d3"], {"x"}),
    ]:
        if done:
            achieve(turns, done[-1])
        assert legal(turns, "reachable") == goal_ids(turns, *reachable)
        assert legal(turns, "existing") == goal_ids(turns, *(everything - set(done)))
        assert legal(turns, "none") == set(range(13))


def test_dropped_key_is_a_legal_goal_again():
    turns = make("a", drop_key=True)
    achieve(turns, "k1")
    assert legal(turns, "reachable") == goal_ids(turns, "d1")
    while not (turns.step([5]).events[0] == -1 and turns.world.state.levels[0].keys == 0):
        turns.step([1])
    assert legal(turns, "reachable") == goal_ids(turns, "k1")
    assert legal(turns, "existing") == goal_ids(turns, "k1", "d1", "x")


def test_seen_mask_has_goals_that_came_into_view():
    turns = make("c", seed=1, max_steps=120)
    rng = np.random.default_rng(0)
    came_into_view, most = set(), 0
    for t in range(360):
        tiles = turns.world.outcomes["tiles"][0].copy()
        tiles[3, 6] = 0  # the agent's own cell shows what it carries
        for tile in tiles.ravel().tolist():
            came_into_view |= {tile - KEY} if KEY <= tile < OPEN_DOOR else set()
            came_into_view |= {FIRST_DOOR_GOAL + (tile - OPEN_DOOR) % 6} if OPEN_DOOR <= tile < WALL else set()
            came_into_view |= {EXIT_GOAL} if tile == EXIT else set()
        assert legal(turns, "seen") == came_into_view & legal(turns, "existing"), t
        most = max(most, len(came_into_view))
        if turns.step([well_or_wildly(rng, turns.world)]).episode_ended[0]:
            came_into_view = set()
    assert most == 5


@pytest.mark.parametrize("graph", [*enumerate_graphs(4), GoalGraph((0, 0, 1, 0, 2, 4), 5)], ids=lambda one: one.name)
def test_reachable_goals_are_the_open_goals_of_the_graph(graph):
    """With random keys held and random doors open, in levels with different colours."""
    n = 200
    turns, rng = make(graph, n, seed=1, size=19), np.random.default_rng(0)
    levels, branches = turns.world._state.levels, graph.n_rooms - 1
    keys, doors = rng.random((2, n, branches)) < 0.5
    levels["keys"], levels["doors"] = keys @ (1 << np.arange(branches)), doors @ (1 << np.arange(branches))
    expected = np.zeros((n, N_GOALS), bool)
    for m, goals in enumerate(open_goals(graph, keys, doors)):
        colours = levels["colours"][m, :branches]
        expected[m, colours] = goals[:branches]
        expected[m, FIRST_DOOR_GOAL + colours] = goals[branches:-1]
        expected[m, EXIT_GOAL] = goals[-1]
    np.testing.assert_array_equal(turns.situation(np.arange(n)).reachable, expected)


def test_no_goal_is_reached_by_something_new():
    """The controller is rewarded, once, for a goal event or for a key, door or exit that comes into view."""
    turns = make("d", n=8, seed=2, goal_mask="seen", reward="intrinsic")
    rng = np.random.default_rng(0)
    found_by_looking = 0
    for _ in range(600):
        everyone = np.arange(8)
        situation = turns.situation(everyone)
        assert situation.masks[turns.ledger.is_meta_turn, NO_GOAL_ACTION].all()  # in addition to seen goals
        turns.choose(situation, np.full(8, NO_GOAL_ACTION))
        seen, found = turns.world.state.levels["seen"].copy(), turns.world.state.levels["found"].copy()
        step = turns.step([well_or_wildly(rng, turns.world, n) for n in everyone])
        went_on = ~step.episode_ended
        now = turns.world.state.levels[went_on]
        is_new = (now["seen"] != seen[went_on]) | (now["found"] != found[went_on])
        is_new |= step.events[went_on] >= FIRST_DOOR_GOAL
        assert step.reached[went_on].tolist() == step.option_ended[went_on].tolist() == is_new.tolist()
        assert step.rewards[went_on].tolist() == is_new.astype(float).tolist()
        found_by_looking += int((is_new & (step.events[went_on] < 0)).sum())
    assert found_by_looking > 20
    assert turns.ledger.illegal_goals.sum() == 0
