"""Restored states of turns, ended episodes, and final observations."""

import numpy as np
import pytest
from turns_helpers import fields, make, well_or_wildly

from hierroom.meta import make_meta, take_turn
from hierroom.support.errors import InputError
from hierroom.turns.kernels import OTHER
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.oracle import shortest_actions


def observed(turns):
    return turns.observe("controller_0", np.arange(len(turns)))


def played(turns, meta, actions):
    moments = []
    for row in actions:
        take_turn(meta, turns)
        moments.append([*fields(turns.step(row)).values(), *observed(turns).as_dict().values()])
    return moments


@pytest.mark.parametrize("autoreset", [True, False])
def test_set_state_repeats_the_same_play(autoreset):
    settings = {"n": 6, "max_steps": 30, "subgoal_horizon": 8, "measure_shortest": True, "autoreset": autoreset}
    turns, meta = make(seed=9, **settings), make_meta("random")
    actions = np.random.default_rng(0).integers(5, size=(100, 6))
    played(turns, meta, actions[:25])  # the middle of an option
    state = turns.get_state()
    kept = {name: array.copy() for name, array in state.items()}
    moments = played(turns, meta, actions[25:])
    for name, array in state.items():
        np.testing.assert_array_equal(array, kept[name], err_msg=name)
    turns.set_state(state)
    elsewhere = make(seed=1, **settings)
    elsewhere.set_state(state)
    for other in (turns, elsewhere):
        for one, again in zip(moments, played(other, meta, actions[25:]), strict=True):
            for a, b in zip(one, again, strict=True):
                np.testing.assert_array_equal(a, b)


def test_set_state_keeps_ended_episodes_ended():
    turns = make("a", n=2, max_steps=40, autoreset=False)
    way = shortest_actions(turns.world.get_state([0])).tolist()
    for action in way + [1] * (40 - len(way)):
        step = turns.step([action, 1])
    assert (step.terminated.tolist(), step.truncated.tolist()) == ([True, False], [False, True])
    other = make("a", n=2, seed=8, autoreset=False)
    other.set_state(turns.get_state())
    for _ in range(2):
        step = other.step([1, 1])
        assert (step.terminated.tolist(), step.truncated.tolist()) == ([True, False], [False, True])


def test_a_state_of_another_shape_raises_input_error():
    turns = make(n=2)
    state = turns.get_state()
    with pytest.raises(InputError, match=r"^turns.is_meta_turn must be an array of bool and shape \(2,\), not of "):
        turns.set_state(make(n=3).get_state())
    del state["shortest"]
    with pytest.raises(
        InputError, match=r"^the state of turns does not hold what get_state gives, but is_meta_turn, goals, last_g"
    ):
        turns.set_state(state)


def test_shortest_length_belongs_to_the_ended_episode():
    turns = make("c", n=4, seed=4, measure_shortest=True, max_steps=80)
    starts = turns.world.get_state()
    rng = np.random.default_rng(0)
    ended = 0
    for _ in range(300):
        step = turns.step([well_or_wildly(rng, turns.world) if n == 0 else 1 for n in range(4)])
        for n in range(4):
            assert step.shortest[n] == len(shortest_actions(starts[n]))
        episode_ended = step.episode_ended
        ended += episode_ended.sum()
        starts.levels[episode_ended], starts.grids[episode_ended] = (
            turns.world.state.levels[episode_ended],
            turns.world.state.grids[episode_ended],
        )
    assert ended > 10
    assert (Turns(EnvConfig(graph="a"), seed=0).step([0]).shortest == -1).all()  # measured only on request


def test_the_final_observation_is_from_before_the_reset():
    turns, slow = make("a", n=8, seed=6, max_steps=20), make("a", n=8, seed=6, max_steps=20, autoreset=False)
    meta, rng, n_going_on = make_meta("random"), np.random.default_rng(0), 0
    for t in range(60):
        for each in (turns, slow):
            take_turn(meta, each)
        actions, last = rng.integers(5, size=8), turns.ledger.last_outcomes.copy()
        step, slow_step = turns.step(actions), slow.step(actions)
        np.testing.assert_array_equal(step.episode_ended, slow_step.episode_ended)
        everyone = np.arange(8)
        final = turns.final_observation("controller_0", step, everyone)
        expected = slow.final_observation("controller_0", slow_step, everyone)
        assert final.masks.all()
        np.testing.assert_array_equal(final.outcomes, np.where(step.option_ended, step.outcomes, last))
        n_going_on += (~step.option_ended & (last != OTHER)).sum()
        assert turns.final_observation("meta_0", step, everyone).masks.tolist() == [[False] * 13 + [True]] * 8
        for name in ("tiles", "goals", "previous_actions", "outcomes"):
            np.testing.assert_array_equal(getattr(final, name), getattr(expected, name), err_msg=name)
        for name in ("row", "col", "direction", "steps", "keys", "doors", "episode"):
            np.testing.assert_array_equal(final.levels[name], expected.levels[name], err_msg=name)
        np.testing.assert_array_equal(observed(turns).previous_actions, np.where(step.episode_ended, 5, actions))
        if step.episode_ended.any():
            assert step.episode_ended.all()
            assert (final.levels["steps"] == 20).all()
            assert (observed(turns).levels["steps"] == 0).all()
            assert not slow.ledger.is_meta_turn.any()
            slow.reset()
            assert t % 20 == 19
    assert n_going_on > 10


def test_autoreset_is_the_default():
    turns = Turns(EnvConfig(graph="a", max_steps=1), seed=0)
    assert turns.n_ended == 0
    assert turns.step([0]).episode_ended.all()
    assert turns.world.state.levels["episode"].tolist() == [1]
    assert turns.n_ended == 1


def test_reset_ended_begins_episodes_instead_of_steps():
    """`AutoresetMode.NEXT_STEP` of Gymnasium's vector environments requires this."""
    turns, expected = make("a", n=4, seed=6, autoreset=False), make("a", n=4, seed=6, autoreset=False)
    moments, _ = (each.step([1, 2, 0, 1]) for each in (turns, expected))
    some = np.array([0, 2])
    turns.reset_ended(some)
    expected.reset(None, some)
    for name, array in expected.get_state().items():
        np.testing.assert_array_equal(turns.get_state()[name], array, err_msg=name)
    assert turns.last_step is moments
    assert moments.actions.tolist() == [5, 2, 5, 1]  # 5: none
    assert moments.goals.tolist() == [-1] * 4


def test_can_split_only_if_environments_are_independent():
    assert make("a", n=3).can_split
    assert not make("hitting_time:8..16", n=3, curriculum_stages=2).can_split
    assert not make("a", n=3, reward=lambda step: step.extrinsic).can_split
