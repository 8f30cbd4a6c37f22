"""What either agent observes and may do."""

import numpy as np
import pytest
from turns_helpers import achieve, goal_ids, make

from hierroom.complexity import analyze
from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, GOAL_VECTORS
from hierroom.meta import choose_goals, make_meta, take_turn
from hierroom.support.errors import InputError
from hierroom.turns.records import AGENTS, NO_OUTCOME, TIMED_OUT


def test_an_illegal_choice_is_no_goal_and_is_counted():
    turns = make("a", n=5)
    (key,) = goal_ids(turns, "k1")
    everyone = np.arange(5)
    situation = turns.situation(everyone)
    keys = turns.world.state.levels["colours"][:, 0]
    turns.choose(situation, [keys[0], EXIT_GOAL, 13, -1, 99])
    assert turns.goals.tolist() == [key, -1, -1, -1, -1]
    assert turns.ledger.illegal_goals.tolist() == [0, 1, 1, 1, 1]
    waiting = turns.situation(everyone)
    assert waiting.masks.tolist() == [[False] * 13 + [True]] * 5
    turns.choose(waiting, [EXIT_GOAL, 13, 13, -1, -1])  # it is not its turn
    assert turns.goals.tolist() == [key, -1, -1, -1, -1]
    assert turns.ledger.illegal_goals.tolist() == [1, 1, 1, 1, 1]
    assert turns.ledger.meta_turns.tolist() == [1] * 5


def test_no_number_is_taken_for_a_goal_that_it_is_not():
    """Not even from the end, as Python counts, where every goal is legal."""
    turns, everyone = make("a", n=4, goal_mask="none"), np.arange(4)
    turns.choose(turns.situation(everyone), [-2, -7, -14, 14])
    assert turns.goals.tolist() == [-1] * 4
    assert turns.ledger.illegal_goals.tolist() == [1] * 4


def test_keys_held_and_doors_open_are_shown_by_colour():
    turns = make("c", seed=3)
    held, is_open = set(), set()
    for name in ("k1", "d1", "k2", "d2"):
        achieve(turns, name)
        (held if name[0] == "k" else is_open).update(goal % FIRST_DOOR_GOAL for goal in goal_ids(turns, name))
        seen = turns.observe("controller_0", np.array([0])).as_dict()
        assert seen["keys_held"].tolist() == [[int(colour in held) for colour in range(6)]]
        assert seen["doors_open"].tolist() == [[int(colour in is_open) for colour in range(6)]]
        assert seen["direction"].tolist() == turns.world.state.levels["direction"].tolist()


def test_actions_the_environment_does_not_have_are_counted_and_only_cost_the_step():
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
        for array in (*observations.values(), situation.uniforms, situation.goals, situation.outcomes):
            array[...] = 1
        situation.state.levels["doors"], situation.state.grids[:] = 63, 0
        return np.full(len(situation), EXIT_GOAL)


def test_a_meta_controller_cannot_change_the_environments():
    turns, twin = make(n=3), make(n=3)
    take_turn(Spoiler(), turns)
    twin.ask(make_meta("none"))
    assert turns.goals.tolist() == [-1] * 3
    state, expected = turns.get_state(), twin.get_state()
    for name in state:
        np.testing.assert_array_equal(state[name], expected[name], err_msg=name)


def test_the_goal_is_shown_to_the_controller_and_the_last_one_to_the_meta_controller():
    turns = make("a", subgoal_horizon=2)
    (key,) = goal_ids(turns, "k1")
    envs = np.array([0])
    for expected in (NO_OUTCOME, TIMED_OUT, TIMED_OUT):
        situation = turns.situation(envs)
        shown = situation.as_dict()
        assert shown["outcome"].tolist() == [expected]
        np.testing.assert_array_equal(shown["goal"], GOAL_VECTORS[[-1 if expected == NO_OUTCOME else key]])
        assert turns.observation_space("meta_0").contains({name: values[0] for name, values in shown.items()})
        turns.choose(situation, [key])
        for _ in range(2):
            seen = turns.observe("controller_0", envs).as_dict()
            np.testing.assert_array_equal(seen["goal"], GOAL_VECTORS[[key]])
            turns.step([1])


def test_advancing_is_a_step_and_tells_of_the_turns_that_it_ended():
    """Beside turns that are asked and stepped; the last observations are those before the reset and the next goal."""
    settings = {"n": 6, "seed": 3, "max_steps": 25, "subgoal_horizon": 4, "reward": "intrinsic"}
    turns, twin = make("c", **settings), make("c", **settings)
    meta, rng = make_meta("random"), np.random.default_rng(0)
    ended = {"options": 0, "episodes": 0}
    for _ in range(200):
        due = turns.due("meta_0")
        np.testing.assert_array_equal(due, np.flatnonzero(twin.ledger.is_meta_turn))
        situation = turns.observe("meta_0", due)
        turns.act("meta_0", situation, choose_goals(meta, situation))
        assert len(turns.due("meta_0")) == 0
        twin.ask(meta)
        actions = rng.integers(5, size=6)
        turns.act("controller_0", turns.observe("controller_0", turns.due("controller_0")), actions)
        told, step = turns.advance(), twin.step(actions)
        assert list(told) == ["meta_0", "controller_0"]
        for name, value in step.as_dict().items():
            np.testing.assert_array_equal(turns.last_step.as_dict()[name], value, err_msg=name)
        options, every = told["meta_0"], told["controller_0"]
        assert options.step is every.step is turns.last_step
        envs = np.flatnonzero(step.option_ended)
        everyone, none = np.arange(6), np.full(6, -1)
        of_options = (
            envs,
            step.goals,
            step.meta_rewards,
            step.meta_elapsed,
            step.terminated,
            step.truncated & ~step.terminated,
        )
        of_steps = everyone, step.goals, step.rewards, np.ones(6), step.return_terminated, step.return_truncated
        for transition, (where, *values), instead in (
            (options, of_options, step.achieved_instead),
            (every, of_steps, none),
        ):
            np.testing.assert_array_equal(transition.envs, where)
            names = ("goals", "rewards", "elapsed", "terminated", "truncated", "episode_ended", "achieved_instead")
            for name, value in zip(names, (*values, step.episode_ended, instead), strict=True):
                np.testing.assert_array_equal(getattr(transition, name), value[where], err_msg=name)
        for agent, transition in told.items():
            rows = rng.permutation(len(transition.envs))[:3]
            last, expected = (
                transition.last_observation(rows),
                twin.final_observation(agent, step, transition.envs[rows]),
            )
            np.testing.assert_array_equal(last.levels["steps"], step.lengths[transition.envs[rows]])
            np.testing.assert_array_equal(last.goals, transition.goals[rows])
            for name, values in last.as_dict().items():
                np.testing.assert_array_equal(values, expected.as_dict()[name], err_msg=name)
        ended["options"] += len(envs)
        ended["episodes"] += int(step.episode_ended.sum())
    assert min(ended.values()) > 20, ended


def test_without_a_seed_nothing_begins_before_the_first_reset():
    turns, expected = make("c", 3, seed=None), make("c", 3, seed=8)
    assert not turns.world.has_begun
    turns.reset(8)
    assert turns.world.has_begun
    state = turns.get_state()
    for name, array in expected.get_state().items():
        np.testing.assert_array_equal(state[name], array, err_msg=name)


class MaskSpoiler:
    def choose(self, observations, legal, situation):
        legal[:] = True  # a copy of its own
        situation.masks[:] = True
        return legal.argmax(axis=1)


def test_a_meta_controller_cannot_make_a_goal_legal():
    turns = make(n=3)
    with pytest.raises(InputError, match=r"the meta-controller MaskSpoiler fails: .*read-only"):
        take_turn(MaskSpoiler(), turns)
    assert turns.goals.tolist() == [-1] * 3


@pytest.mark.parametrize("agent", AGENTS)
def test_the_order_of_the_environments_is_that_asked_for(agent):
    turns, twin = (make("rooms:3", n=4, seed=2, measure_shortest=True) for _ in range(2))
    order = np.array([3, 1, 0, 2])
    there, one_by_one = turns.observe(agent, order), [turns.observe(agent, np.array([env])) for env in order]
    np.testing.assert_array_equal(there.tiles, np.concatenate([one.tiles for one in one_by_one]))
    np.testing.assert_array_equal(there.levels["row"], [one.levels["row"][0] for one in one_by_one])
    turns.reset(5, order)
    twin.reset(5)
    np.testing.assert_array_equal(turns.ledger.shortest, twin.ledger.shortest)
    assert len(set(twin.ledger.shortest.tolist())) > 1


def test_the_complexity_is_that_with_the_actions_there_are():
    expected = {drop_key: make("d", drop_key=drop_key).complexity.expected_steps for drop_key in (False, True)}
    assert expected == {drop_key: analyze("d", drop_key=drop_key).expected_steps for drop_key in (False, True)}
    assert expected[False] < expected[True]


def test_nobody_can_change_which_actions_others_may_take():
    turns = make("a", n=3)
    some = turns.observe("controller_0", np.arange(2))
    with pytest.raises(ValueError, match="read-only"):
        some.masks[:] = False
