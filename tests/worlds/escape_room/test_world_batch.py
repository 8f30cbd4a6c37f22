"""Batches: the same episodes alone and in any batch, saved and restored states, and ends of episodes."""

import threading

import numpy as np
import pytest

from hierroom.goals import EXIT_GOAL, NAMED_GRAPHS, GoalGraph
from hierroom.support.errors import InputError
from hierroom.support.thread_pool import MIN_ENVS_PER_THREAD
from hierroom.worlds.escape_room import engine
from hierroom.worlds.escape_room.constants import FORWARD, LEFT
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.layout import OUTCOME, State
from hierroom.worlds.escape_room.oracle import shortest_actions

GRAPHS = [*NAMED_GRAPHS.values(), GoalGraph((0, 1, 2, 0, 1, 2), 6)]


def actions_of(n_steps, num_envs, seed=0):
    return np.random.default_rng(seed).choice(6, size=(n_steps, num_envs), p=[0.4, 0.15, 0.15, 0.1, 0.1, 0.1])


def assert_same(one: np.ndarray, other: np.ndarray):
    for name in one.dtype.names or ():
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)


def same_state(one: State, other: State) -> bool:
    return bool((one.grids == other.grids).all() and (one.levels == other.levels).all())


# The same episode alone and in any batch.


def test_environment_is_the_same_alone_and_in_a_batch():
    settings = {"seed": 3, "max_steps": 40, "drop_key": True}
    together = Engine(GRAPHS, 128, **settings)
    alone = [Engine(GRAPHS, first_index=n, **settings) for n in range(128)]
    for actions in actions_of(130, 128):
        one_by_one = np.concatenate([env.step(actions[n : n + 1]) for n, env in enumerate(alone)])
        assert_same(one_by_one, together.step(actions))
    assert (together.state.levels["episode"] >= 3).all()
    for n, env in enumerate(alone):
        assert same_state(env.state, together.state[n])
        assert (env.finals == together.finals[n : n + 1]).all()


def test_two_threads_equal_one_thread(monkeypatch):
    num_envs = 2 * MIN_ENVS_PER_THREAD + 1
    one, two = (Engine(GRAPHS, num_envs, size=11, seed=4, max_steps=30, threads=threads) for threads in (1, 2))
    used, step = [], engine._STEP.run

    def noted_step(*arrays):
        used.append((threading.get_ident(), len(arrays[0])))
        step(*arrays)

    monkeypatch.setattr(engine._STEP, "run", noted_step)
    for actions in actions_of(70, num_envs):
        assert_same(one.step(actions), two.step(actions))
    assert same_state(one.state, two.state)
    assert (one.finals == two.finals).all()
    sizes = {size for thread, size in used if thread != threading.get_ident()}
    assert sizes == {MIN_ENVS_PER_THREAD, MIN_ENVS_PER_THREAD + 1}


def test_reset_with_seed_restarts_and_without_continues():
    world = Engine(GRAPHS, 20, seed=5)
    first = world.get_state()
    world.reset()
    second = world.get_state()
    world.step(np.zeros(20, np.int64))
    world.reset(5)
    assert same_state(world.state, first)
    world.reset()
    assert same_state(world.state, second)
    assert (world.outcomes["length"] == 0).all()
    assert not world.outcomes["achieved"].any()


def test_levels_differ_by_seed_environment_and_episode():
    worlds = [Engine([NAMED_GRAPHS["c"]], 50, seed=seed) for seed in (0, 1, 2**63 - 1)]
    grids = [grid.tobytes() for world in worlds for grid in world.state.grids]
    worlds[0].reset()
    grids += [grid.tobytes() for grid in worlds[0].state.grids]
    assert len(set(grids)) == len(grids)


def test_stagger_clocks_spreads_the_episode_ends():
    world = Engine(GRAPHS, 10, max_steps=100)
    world.stagger_clocks()
    assert world.state.levels["steps"].tolist() == list(range(0, 100, 10))
    lengths = []
    for _ in range(100):
        outcomes = world.step(np.full(10, LEFT))
        lengths.append(outcomes["truncated"].sum())
    assert max(lengths) == 1


# States.


def test_replay_from_a_branch_gives_the_same_outcomes():
    world = Engine(GRAPHS, 30, seed=7, max_steps=60, drop_key=True)
    actions = actions_of(150, 30)
    for action in actions[:50]:
        world.step(action)
    branch = world.get_state()
    first = [world.step(action).copy() for action in actions[50:100]]
    reached = world.get_state()
    for action in actions[100:]:
        world.step(action)
    world.set_state(branch)
    np.testing.assert_array_equal(world.outcomes["length"], branch.levels["steps"])
    for expected, action in zip(first, actions[50:100], strict=True):
        outcomes = world.step(action)
        episode_ended = outcomes["terminated"] | outcomes["truncated"]
        assert_same(outcomes[episode_ended], expected[episode_ended])
        assert_same(outcomes[[name for name in OUTCOME.names if name != "final_tiles"]], expected)
    assert same_state(world.state, reached)


def assert_same_view(world: Engine, n: int):
    shown = world.outcomes["tiles"][n].copy()
    probe = Engine(GRAPHS, size=world.state.size)
    probe.set_state(world.get_state(n))
    probe.step_within_episode([-1])
    np.testing.assert_array_equal(probe.outcomes["tiles"][0], shown)


def test_set_state_restores_some_environments():
    world = Engine(GRAPHS, 10, seed=8)
    start = world.get_state([2, 5])
    for action in actions_of(30, 10):
        world.step_within_episode(action)
    before, outcomes = world.get_state(), world.outcomes.copy()
    world.set_state(start, [5, 7])
    assert same_state(world.get_state(slice(5, 6)), start[0])
    assert same_state(world.get_state(7), start[1])
    others = np.delete(np.arange(10), [5, 7])
    assert same_state(world.get_state(others), before[others])
    assert_same(world.outcomes[others], outcomes[others])
    for n in range(10):
        assert_same_view(world, n)


def test_set_state_of_some_leaves_unset_environments_blank():
    """A kernel would look around a place before the grid's first cell: kernels check no bounds."""
    world = Engine(GRAPHS, 2, seed=None)
    world.set_state(Engine(GRAPHS, seed=8).get_state(), [1])
    assert world.outcomes["tiles"].any(axis=(1, 2)).tolist() == [False, True]


def test_get_state_returns_a_copy():
    world = Engine(GRAPHS, 3, seed=9)
    taken = world.get_state()
    kept = taken.copy()
    world.step(np.full(3, LEFT))
    assert same_state(taken, kept)
    world.set_state(taken)
    world.step(np.full(3, LEFT))
    assert same_state(taken, kept)


def test_step_takes_actions_as_arrays_or_lists():
    worlds = [Engine(GRAPHS, 5, seed=10) for _ in range(4)]
    for actions in actions_of(40, 5):
        strided = np.zeros((5, 3), np.int64)
        strided[:, 1] = actions
        for world, given in zip(worlds, (actions, strided[:, 1], actions.astype("i4"), actions.tolist()), strict=True):
            world.step(given)
    for world in worlds[1:]:
        assert same_state(world.state, worlds[0].state)


# The ends of episodes.


def test_truncation_keeps_final_view_and_begins_next_episode():
    world = Engine([NAMED_GRAPHS["c"]], 20, seed=10, max_steps=5)
    twin = Engine([NAMED_GRAPHS["c"]], 20, seed=10, max_steps=5)
    for step, actions in enumerate(actions_of(5, 20), start=1):
        outcomes, unreset = world.step(actions), twin.step_within_episode(actions)
        assert (outcomes["truncated"] == (step == 5)).all()
        assert (outcomes["length"] == step).all()
        assert not outcomes["terminated"].any()
    np.testing.assert_array_equal(outcomes["final_tiles"], unreset["tiles"])
    assert (world.finals == twin.state.levels).all()
    twin.reset()
    assert same_state(world.state, twin.state)
    np.testing.assert_array_equal(outcomes["tiles"], twin.outcomes["tiles"])
    assert (world.state.levels["episode"] == 1).all()


def test_exit_on_the_last_step_sets_both_flags():
    """As in MiniGrid, both flags are set."""
    length = len(shortest_actions(Engine([NAMED_GRAPHS["a"]], seed=11).state))
    world = Engine([NAMED_GRAPHS["a"]], seed=11, max_steps=length)
    for action in shortest_actions(world.state):
        outcome = world.step_within_episode([action])[0]
    assert (outcome.reward, outcome.terminated, outcome.truncated) == (1, True, True)
    assert (outcome.achieved, outcome.n_first) == (1 << EXIT_GOAL, 1)


def test_step_after_the_end_changes_nothing():
    world = Engine([NAMED_GRAPHS["a"]], seed=12)
    for action in shortest_actions(world.state):
        world.step_within_episode([action])
    ended = world.get_state()
    outcome = world.step_within_episode([FORWARD])[0]
    assert same_state(world.state, ended)
    assert (outcome.reward, outcome.achieved, outcome.terminated) == (0, 0, True)
    assert (outcome.n_first, outcome.is_novel, outcome.is_discovery) == (0, False, False)


# Wrong input.


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"size": 10}, "size must be a whole number from 11 to 63, not 10"),
        ({"num_envs": 0}, "num_envs must be a whole number from 1 to 2**31 - 1, not 0"),
        ({"max_steps": 2**31}, "max_steps must be a whole number from 1 to 2**31 - 1, not 2147483648"),
        ({"threads": 0}, "threads must be a whole number from 1 to 2**31 - 1, not 0"),
        ({"seed": 2**63}, "a seed must be a whole number from 0 to 2**63 - 1"),
        ({"graphs": []}, "levels need at least one goal graph"),
    ],
)
def test_invalid_settings_raise_input_error(settings, message):
    with pytest.raises(InputError, match=message.replace("**", r"\*\*")):
        Engine(**{"graphs": [NAMED_GRAPHS["a"]], **settings})


@pytest.mark.parametrize("actions", [[0], [0, 0, 0], [[0, 0]], [0.0, 1.0], 0, ["left", "right"]])
def test_invalid_actions_raise_input_error(actions):
    world = Engine([NAMED_GRAPHS["a"]], 2)
    for step in (world.step, world.step_within_episode):
        with pytest.raises(InputError, match="actions must be 2 whole numbers, one for each environment"):
            step(actions)


def test_invalid_states_raise_input_error():
    world = Engine([NAMED_GRAPHS["a"]], 2)
    with pytest.raises(InputError, match="must hold 2 environments of size 19; it holds 1 of size 19"):
        world.set_state(world.get_state(0))
    with pytest.raises(InputError, match="must hold 2 environments of size 19; it holds 2 of size 11"):
        world.set_state(Engine([NAMED_GRAPHS["a"]], 2, size=11).state)
    with pytest.raises(InputError, match="environments are numbered from 0 to 1; there is no 2"):
        world.get_state(2)
