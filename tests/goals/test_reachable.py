"""The reachable states of a level, compared with play in the level."""

import numpy as np
import pytest

from hierroom.goals import NAMED_GRAPHS, GoalGraph
from hierroom.support.errors import InputError
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.measured_levels import level_mdp, measure_levels
from hierroom.worlds.escape_room.oracle import shortest_lengths
from hierroom.worlds.escape_room.reachable import reachable_states


@pytest.mark.parametrize("drop_key", [False, True])
@pytest.mark.parametrize("letter", "ac")
def test_play_follows_the_reachable_states(letter, drop_key):
    world = Engine([NAMED_GRAPHS[letter]], size=11, drop_key=drop_key, seed=3, max_steps=2**30)
    table = reachable_states(world.state)
    rng, seen, state = np.random.default_rng(0), {}, 0
    first = world.get_state()
    for _ in range(20_000):
        action = rng.integers(world.n_actions)
        outcome = world.step_within_episode([action])
        reward = float(outcome["reward"][0])
        assert reward == table.rewards[state, action]
        state = table.transitions[state, action]
        if outcome["terminated"][0]:
            assert state == len(table.transitions) - 1
            world.set_state(first)
            state = 0
        level = world.state.levels[0]
        pose = (level.row, level.col, level.direction, level.keys, level.doors)
        assert seen.setdefault(state, pose) == pose  # each number means one state
    assert (table.transitions[-1] == len(table.transitions) - 1).all()
    assert not table.rewards[-1].any()


@pytest.mark.parametrize("letter", "abcdefg")
def test_shortest_solutions_equal_the_oracle(letter):
    world = Engine([NAMED_GRAPHS[letter]], seed=5)
    assert level_mdp(NAMED_GRAPHS[letter], 5).shortest_solution() == shortest_lengths(world.state)[0]


def test_state_count_without_drop_equals_the_formula():
    """Graph a: the centre with the key on the floor, held, or the door open; the doorway and room once it is open."""
    world = Engine([GoalGraph((0,), 1)], size=11, seed=0)
    level = world.state.levels[0]
    (top, left, bottom, right), (up, west, down, east) = level.rectangles[:2]
    centre, room = (bottom - top + 1) * (right - left + 1), (down - up + 1) * (east - west + 1)
    expected = 4 * ((centre - 1) + centre + (centre + 1 + room - 1)) + 1  # nobody stands on a key or the exit
    assert len(reachable_states(world.state).transitions) == expected


def test_measure_levels_measures_a_level():
    (measured,) = measure_levels([NAMED_GRAPHS["a"]], 1, horizon=60, seed=2)
    assert measured.name == "a 2"
    assert measured.mdp.shortest == level_mdp(NAMED_GRAPHS["a"], 2).shortest_solution()
    assert 0 < measured.mdp.random_success < 0.1


def test_invalid_input_raises_input_error():
    world = Engine([NAMED_GRAPHS["a"]], 2, seed=0)
    ended = Engine([NAMED_GRAPHS["a"]], seed=0, max_steps=1)
    ended.step_within_episode([0])
    for attempt, words in (
        (lambda: reachable_states(world.state), "holds 2 environments"),
        (lambda: reachable_states(world.state[0], 100), "more than 100 states"),
        (lambda: reachable_states(ended.state), "has ended"),
        (lambda: measure_levels([], 0), "at least one level"),
    ):
        with pytest.raises(InputError, match=words):
            attempt()
