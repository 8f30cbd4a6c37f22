"""What either agent is shown and may do."""

import numpy as np
from turns_rooms import achieve, goal_ids, make

from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, GOAL_VECTORS
from hierroom.meta import make_meta
from hierroom.options import NO_OUTCOME, TIMED_OUT


def test_what_is_not_legal_is_no_goal_and_counted():
    turns = make("a", n=5)
    (key,) = goal_ids(turns, "k1")
    everyone = np.arange(5)
    masks = turns.meta_masks(turns.situation(everyone))
    keys = turns.world.state.levels["colours"][:, 0]
    turns.choose(everyone, [keys[0], EXIT_GOAL, 13, -1, 99], masks)
    assert turns.goals.tolist() == [key, -1, -1, -1, -1]
    assert turns.ledger.illegal_goals.tolist() == [0, 1, 1, 1, 1]
    waiting = turns.meta_masks(turns.situation(everyone))
    assert waiting.tolist() == [[False] * 13 + [True]] * 5
    turns.choose(everyone, [EXIT_GOAL, 13, 13, -1, -1], waiting)  # it is not its turn
    assert turns.goals.tolist() == [key, -1, -1, -1, -1]
    assert turns.ledger.illegal_goals.tolist() == [1, 1, 1, 1, 1]
    assert turns.ledger.meta_turns.tolist() == [1] * 5


def test_no_number_is_taken_for_a_goal_that_it_is_not():
    """Not even from the end, as Python counts, where every goal is legal."""
    turns, everyone = make("a", n=4, goal_mask="none"), np.arange(4)
    turns.choose(everyone, [-2, -7, -14, 14], turns.meta_masks(turns.situation(everyone)))
    assert turns.goals.tolist() == [-1] * 4
    assert turns.ledger.illegal_goals.tolist() == [1] * 4


def test_keys_held_and_doors_open_are_shown_by_colour():
    turns = make("c", seed=3)
    held, is_open = set(), set()
    for name in ("k1", "d1", "k2", "d2"):
        achieve(turns, name)
        (held if name[0] == "k" else is_open).update(goal % FIRST_DOOR_GOAL for goal in goal_ids(turns, name))
        seen = turns.controller_observations(turns.observation())
        assert seen["keys_held"].tolist() == [[int(colour in held) for colour in range(6)]]
        assert seen["doors_open"].tolist() == [[int(colour in is_open) for colour in range(6)]]
        assert seen["direction"].tolist() == turns.world.state.levels["direction"].tolist()


def test_actions_the_room_does_not_have_are_counted_and_only_cost_the_step():
    turns = make("a", n=4)
    before = turns.world.get_state()
    step = turns.step([-1, 5, 77, 1])
    assert step.illegal_actions.tolist() == [1, 1, 1, 0]
    after = turns.world.get_state()
    for name in ("row", "col", "direction", "keys"):
        np.testing.assert_array_equal(after.levels[name][:3], before.levels[name][:3])
    assert after.levels["steps"].tolist() == [1] * 4


def test_without_a_choice_there_is_no_goal():
    turns = make("a", reward="intrinsic")
    achieve(turns, "k1")
    assert turns.ledger.is_meta_turn[0]  # an event ends 'no goal'
    assert turns.ledger.last_goals[0] == -1
    assert turns.ledger.meta_turns[0] == 0


class Spoiler:
    """Chooses the exit, and tries to make that legal."""

    def choose(self, observations, legal, situation):
        legal[:] = True
        for array in (*observations.values(), situation.draws, situation.last_goals, situation.last_outcomes):
            array[...] = 1
        situation.state.levels["doors"], situation.state.grids[:] = 63, 0
        return np.full(len(situation), EXIT_GOAL)


def test_a_meta_controller_cannot_change_the_rooms():
    turns, twin = make(n=3), make(n=3)
    turns.ask(Spoiler())
    twin.ask(make_meta("none"))
    assert turns.goals.tolist() == [-1] * 3
    state, expected = turns.get_state(), twin.get_state()
    for name in state:
        np.testing.assert_array_equal(state[name], expected[name], err_msg=name)


def test_the_goal_is_shown_to_the_controller_and_the_last_one_to_the_meta_controller():
    turns = make("a", subgoal_horizon=2)
    (key,) = goal_ids(turns, "k1")
    room = np.array([0])
    for expected in (NO_OUTCOME, TIMED_OUT, TIMED_OUT):
        situation = turns.situation(room)
        masks = turns.meta_masks(situation)
        shown = turns.meta_observations(turns.meta_observation(room), situation.last_outcomes, masks)
        assert shown["outcome"].tolist() == [expected]
        np.testing.assert_array_equal(shown["goal"], GOAL_VECTORS[[-1 if expected == NO_OUTCOME else key]])
        assert turns.meta_space().contains({name: values[0] for name, values in shown.items()})
        turns.choose(room, [key], masks)
        for _ in range(2):
            seen = turns.controller_observations(turns.observation(room))
            np.testing.assert_array_equal(seen["goal"], GOAL_VECTORS[[key]])
            turns.step([1])
