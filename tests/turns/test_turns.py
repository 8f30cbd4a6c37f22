"""Observations and legal actions of both agents."""

import numpy as np
import pytest
from turns_helpers import achieve, fields, goal_ids, make

from hierroom.complexity import analyze
from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, GOAL_VECTORS
from hierroom.meta import choose_goals, make_meta, take_turn
from hierroom.turns.records import AGENTS, NO_OUTCOME, TIMED_OUT


def test_illegal_goal_becomes_no_goal_and_is_counted():
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
    turns.choose(waiting, [EXIT_GOAL, 13, 13, -1, -1])  # no turn of the meta-controller
    assert turns.goals.tolist() == [key, -1, -1, -1, -1]
    assert turns.ledger.illegal_goals.tolist() == [1, 1, 1, 1, 1]
    assert turns.ledger.meta_turns.tolist() == [1] * 5


def test_observation_shows_held_keys_and_open_doors():
    turns = make("c", seed=3)
    held, is_open = set(), set()
    for name in ("k1", "d1", "k2", "d2"):
        achieve(turns, name)
        (held if name[0] == "k" else is_open).update(goal % FIRST_DOOR_GOAL for goal in goal_ids(turns, name))
        seen = turns.observe("controller_0", np.array([0])).as_dict()
        assert seen["keys_held"].tolist() == [[int(colour in held) for colour in range(6)]]
        assert seen["doors_open"].tolist() == [[int(colour in is_open) for colour in range(6)]]
        assert seen["direction"].tolist() == turns.world.state.levels["direction"].tolist()


def test_turns_without_a_choice_have_no_goal():
    turns = make("a", reward="intrinsic")
    achieve(turns, "k1")
    assert turns.ledger.is_meta_turn[0]  # an event ends 'no goal'
    assert turns.ledger.last_goals[0] == -1
    assert turns.ledger.meta_turns[0] == 0


class Spoiler:
    def choose(self, observations, legal, situation):
        legal[:] = True
        for array in observations.values():
            array[...] = 1
        return np.full(len(situation), EXIT_GOAL)


def test_a_meta_controller_cannot_change_the_environments():
    turns, twin = make(n=3), make(n=3)
    take_turn(Spoiler(), turns)
    take_turn(make_meta("none"), twin)
    assert turns.goals.tolist() == [-1] * 3
    for agent in AGENTS:
        with pytest.raises(ValueError, match="read-only"):
            turns.observe(agent, np.arange(2)).masks[:] = True
    state, expected = turns.get_state(), twin.get_state()
    for name in state:
        np.testing.assert_array_equal(state[name], expected[name], err_msg=name)


def test_agents_observe_the_current_and_the_last_goal():
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


def test_advance_equals_step_and_gives_ended_turns():
    """Compare with `Turns.step`; the last observations are from before the reset and the next goal."""
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
        take_turn(meta, twin)
        actions = rng.integers(5, size=6)
        turns.act("controller_0", turns.observe("controller_0", turns.due("controller_0")), actions)
        advanced, step = turns.step(), twin.step(actions)
        assert advanced is turns.last_step
        for name, value in fields(step).items():
            np.testing.assert_array_equal(fields(advanced)[name], value, err_msg=name)
        options = np.flatnonzero(step.option_ended)
        of_options = step.meta_rewards, step.meta_elapsed, step.terminated, step.truncated & ~step.terminated
        of_steps = step.rewards, np.ones(6), step.return_terminated, step.return_truncated
        for agent, where, values in (("meta_0", options, of_options), ("controller_0", np.arange(6), of_steps)):
            envs, *ended_turns = advanced.ended_turns(agent)
            np.testing.assert_array_equal(envs, where)
            for value, right in zip(ended_turns, values, strict=True):
                np.testing.assert_array_equal(value, right[where])
            envs = rng.permutation(envs)[:3]
            last = turns.final_observation(agent, advanced, envs)
            np.testing.assert_array_equal(last.levels["steps"], step.lengths[envs])
            np.testing.assert_array_equal(last.goals, step.goals[envs])
        ended["options"] += len(options)
        ended["episodes"] += int(step.episode_ended.sum())
    assert min(ended.values()) > 20, ended


def test_turns_without_seed_begin_at_the_first_reset():
    turns, expected = make("c", 3, seed=None), make("c", 3, seed=8)
    assert not turns.world.has_begun
    turns.reset(8)
    assert turns.world.has_begun
    state = turns.get_state()
    for name, array in expected.get_state().items():
        np.testing.assert_array_equal(state[name], array, err_msg=name)


@pytest.mark.parametrize("agent", AGENTS)
def test_observe_and_reset_keep_the_given_order(agent):
    turns, twin = (make("rooms:3", n=4, seed=2, measure_shortest=True) for _ in range(2))
    order = np.array([3, 1, 0, 2])
    there, one_by_one = turns.observe(agent, order), [turns.observe(agent, np.array([env])) for env in order]
    np.testing.assert_array_equal(there.tiles, np.concatenate([one.tiles for one in one_by_one]))
    np.testing.assert_array_equal(there.levels["row"], [one.levels["row"][0] for one in one_by_one])
    turns.reset(5, order)
    twin.reset(5)
    np.testing.assert_array_equal(turns.ledger.shortest, twin.ledger.shortest)
    assert len(set(twin.ledger.shortest.tolist())) > 1


def test_complexity_depends_on_drop_key():
    expected = {drop_key: make("d", drop_key=drop_key).world.complexity.expected_steps for drop_key in (False, True)}
    assert expected == {drop_key: analyze("d", drop_key=drop_key).expected_steps for drop_key in (False, True)}
    assert expected[False] < expected[True]
