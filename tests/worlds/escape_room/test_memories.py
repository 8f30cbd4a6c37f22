"""Levels keep only the requested memories of their episode; the others stay zero, and nothing else changes."""

from itertools import chain, combinations

import numpy as np
import pytest
from turns_helpers import make

from hierroom.goals import NAMED_GRAPHS, GoalGraph
from hierroom.turns.rewards import REWARDS
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.layout import MEMORIES

GRAPHS = [*NAMED_GRAPHS.values(), GoalGraph((0, 1, 2, 0, 1, 2), 6)]
SUBSETS = list(chain.from_iterable(combinations(MEMORIES, size) for size in range(len(MEMORIES) + 1)))
N_ENVS = 32


def make_world(memories, seed=3, max_steps=80):
    return Engine(GRAPHS, N_ENVS, size=11, max_steps=max_steps, drop_key=True, seed=seed, memories=memories)


def actions_of(n_steps, seed=0):
    return np.random.default_rng(seed).choice(6, size=(n_steps, N_ENVS), p=[0.45, 0.15, 0.15, 0.1, 0.1, 0.05])


def assert_equal(one, other, but=()):
    for name in one.dtype.names or ():
        if name not in but:
            np.testing.assert_array_equal(one[name], other[name], err_msg=name)


def assert_same_world(one, other):
    np.testing.assert_array_equal(one.state.grids, other.state.grids)
    assert_equal(one.state.levels, other.state.levels)
    assert_equal(one.finals, other.finals)
    assert_equal(one.outcomes, other.outcomes)


@pytest.mark.parametrize("step", ["step", "step_within_episode"])
@pytest.mark.parametrize("memories", SUBSETS, ids=lambda memories: "-".join(memories) or "nothing")
def test_unrequested_memories_stay_zero(memories, step):
    world, plain, full = make_world(memories), make_world([]), make_world(MEMORIES)
    used, n_novel = set(), 0
    for actions in actions_of(200):
        outcomes, of_plain, of_full = (getattr(each, step)(actions) for each in (world, plain, full))
        assert_equal(outcomes, of_plain, but=["is_novel"])
        assert not of_plain["is_novel"].any()
        np.testing.assert_array_equal(outcomes["is_novel"], of_full["is_novel"] & ("visited" in memories))
        n_novel += outcomes["is_novel"].sum()
        np.testing.assert_array_equal(world.state.grids, plain.state.grids)
        for levels, of_plain, of_full in (
            (world.state.levels, plain.state.levels, full.state.levels),
            (world.finals, plain.finals, full.finals),
        ):
            assert_equal(levels, of_plain, but=["remembers", *MEMORIES])
            for name in MEMORIES:
                assert not of_plain[name].any()
                np.testing.assert_array_equal(levels[name], of_full[name] if name in memories else 0)
                used |= {name} if levels[name].any() else set()
    assert used == set(memories)
    assert (n_novel > 100) == ("visited" in memories)


@pytest.mark.parametrize("memory", MEMORIES)
def test_memory_requested_later_starts_at_the_next_reset(memory):
    world, asked_at_once = make_world([], seed=1), make_world([memory], seed=8)
    for actions in actions_of(30):
        world.step(actions)
    assert not world.state.levels[memory].any()
    world.remember([memory])
    world.reset(8)
    world._finals[:] = asked_at_once.finals
    is_used = False
    for actions in actions_of(200, seed=1):  # of several episodes
        world.step(actions)
        asked_at_once.step(actions)
        assert_same_world(world, asked_at_once)
        is_used |= world.state.levels[memory].any()
    assert is_used
    assert (world.state.levels["episode"] >= 2).all()


def test_state_contains_the_memories_of_its_levels():
    remembering, other = make_world(MEMORIES), make_world([], seed=9)
    for actions in actions_of(50):
        remembering.step(actions)
        other.step(actions)
    other.set_state(remembering.get_state())
    for actions in actions_of(150, seed=2):
        remembering.step(actions)
        other.step(actions)
        np.testing.assert_array_equal(other.outcomes["is_novel"], remembering.outcomes["is_novel"])
        assert_equal(other.state.levels, remembering.state.levels)
    assert remembering.state.levels["explored"].any()


@pytest.mark.parametrize("reward", REWARDS)
def test_turns_keep_requested_and_reward_memories(reward):
    def bits(names):
        return sum(MEMORIES[name] for name in names)

    needed = {"novelty": {"visited"}}.get(reward, set())
    for asked in SUBSETS:
        turns = make("c", 3, reward=reward, memories=asked)
        assert (turns.world.state.levels["remembers"] == bits(needed | set(asked))).all()
