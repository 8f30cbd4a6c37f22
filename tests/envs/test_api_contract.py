"""Parts of the API contract that the checkers of PettingZoo and Gymnasium leave out."""

import copy
import itertools
import warnings

import gymnasium
import numpy as np
import pytest
import torch
from api_kinds import KINDS, actions, begin
from plain_values import plain

import hierroom
from hierroom.gym_env import EscapeRoom
from hierroom.support.errors import InputError
from hierroom.vector_env import EscapeRooms

AGENTS = ["meta_0", "controller_0"]


def play(env, rng, episodes):
    """Play an AEC environment with random legal actions; return each result of ``last`` with the action taken."""
    observed = []
    for _ in range(episodes):
        for agent in env.agent_iter():
            observation, reward, terminated, truncated, info = env.last()
            action = None
            if not (terminated or truncated):
                action = int(rng.choice(np.flatnonzero(observation["action_mask"])))
            observed.append((agent, observation, reward, terminated, truncated, copy.deepcopy(info), action))
            env.step(action)
        env.reset()
    return observed


def make(seed, **settings):
    env = hierroom.env(**{"graph": "d", "size": 11, "max_steps": 60, "drop_key": True, **settings})
    env.reset(seed=seed)
    return env


def test_twenty_episodes_repeat_only_with_the_same_seed():
    observed, again, other = (play(make(seed), np.random.default_rng(0), 20) for seed in (3, 3, 4))
    assert len(observed) > 20 * 60
    assert plain(observed) == plain(again)
    assert plain(observed[0]) != plain(other[0])
    starts = {repr(entry[1]) for entry in observed if entry[0] == "meta_0" and entry[5]["elapsed"] == 0}
    assert len(starts) > 10


def test_an_episode_of_five_options_has_two_agents():
    env = make(1, subgoal_horizon=4, max_steps=20)
    observed = play(env, np.random.default_rng(0), 1)
    turns = [entry for entry in observed if entry[0] == "meta_0" and entry[-1] is not None]
    assert len(turns) == 5
    assert {entry[0] for entry in observed} == set(AGENTS) == set(env.possible_agents)
    assert [entry[5]["elapsed"] for entry in turns] == [0, 4, 4, 4, 4]
    assert {entry[5]["elapsed"] for entry in observed if entry[0] == "controller_0"} == {0, 1}


INFO = dict.fromkeys(("goal_event", "elapsed", "illegal_actions", "length", "shortest_length"), int) | {"success": bool}


def test_results_are_plain_python_with_fixed_info_keys():
    """Libraries allocate memory for the infos of the first reset, and for no other keys."""
    parallel, single = hierroom.parallel_env(size=11, max_steps=6), EscapeRoom(max_steps=6)
    observed = play(make(0, max_steps=6, reward="bonus"), np.random.default_rng(0), 3)
    results, infos = [entry[2:5] for entry in observed], [entry[5] for entry in observed]
    for _ in range(3):
        infos += [*parallel.reset()[1].values(), single.reset()[1]]
        for t in range(6):
            assert parallel.agents == AGENTS
            *of_agents, both = parallel.step({"meta_0": 13, "controller_0": 1})[1:]
            *alone, info = single.step(1)[1:]
            results += [*zip(*(values.values() for values in of_agents), strict=True), alone]
            infos += [*both.values(), info]
            assert {info["length"] for info in infos[-3:]} == {t + 1}
        assert parallel.agents == []
    assert all([type(value) for value in values] == [float, bool, bool] for values in results)
    assert all({name: type(value) for name, value in info.items()} == INFO for info in infos)
    assert all(info["shortest_length"] > 0 and not info["success"] for info in infos)


def spoil(thing):
    if isinstance(thing, dict):
        for key, value in list(thing.items()):
            spoil(value)
            thing[key] = value if isinstance(value, np.ndarray) else None
    elif isinstance(thing, (tuple, list)) or (isinstance(thing, np.ndarray) and thing.dtype == object):
        for value in thing:
            spoil(value)
    elif isinstance(thing, np.ndarray) and thing.ndim:
        thing[...] = 1 - thing.astype(np.int64)


def arrays_of(thing):
    if isinstance(thing, np.ndarray) and thing.dtype != object:
        yield thing
    elif isinstance(thing, (dict, tuple, list, np.ndarray)):
        for value in thing.values() if isinstance(thing, dict) else thing:
            yield from arrays_of(value)


@pytest.mark.parametrize("kind", KINDS)
def test_returned_arrays_belong_to_the_caller(kind):
    make, play = KINDS[kind]
    env, twin = make(), make()
    for each in (env, twin):
        begin(each)
    for observed, expected in zip(play(env, actions(120)), play(twin, actions(120)), strict=True):
        assert plain(observed) == plain(expected)
        assert not any(np.shares_memory(one, other) for one, other in itertools.combinations(arrays_of(observed), 2))
        spoil(observed)


@pytest.mark.parametrize("copies", [True, False])
def test_kept_array_is_not_overwritten_by_later_steps(copies):
    env, rng, kept = EscapeRooms(3, "a", size=11, max_steps=25, copy=copies), np.random.default_rng(0), []
    env.reset(seed=0)
    for step in range(120):
        arrays = [*arrays_of(env.step(rng.integers(5, size=3))[0 if copies else 1 :])]
        one = arrays[step % len(arrays)]
        one = one[1:] if step // len(arrays) % 2 else one  # alternate between the array and a view of a part
        kept.append((one, one.copy()))
        del arrays
    assert all(np.array_equal(one, expected) for one, expected in kept)


@pytest.mark.parametrize("make_one", [hierroom.env, hierroom.parallel_env, EscapeRoom, lambda: EscapeRooms(2)])
def test_reset_warns_once_of_ignored_options(make_one):
    ignored = {f"graph {id(make_one)}": "b"}  # a name without a warning so far in this process
    with pytest.warns(UserWarning, match=r"^a reset takes .*; it ignores 'graph "):
        make_one().reset(seed=1, options=ignored)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        make_one().reset(seed=1, options=ignored)


def test_unseeded_environments_and_their_episodes_differ():
    """Compare five episodes of each environment, as two episodes can begin with the same view."""
    for make_one in (hierroom.parallel_env, EscapeRoom, lambda: EscapeRooms(4)):
        several = []
        for _ in range(6):
            env = make_one()
            several.append([repr(env.reset()[0]) for _ in range(5)])
        assert len({episodes[0] for episodes in several}) > 3
        assert all(len(set(episodes)) > 2 for episodes in several)


def test_observation_entries_are_valid_torch_module_names():
    """Libraries make a module for each entry; one named as a method of `ModuleDict`, such as keys, breaks them."""
    for space in (hierroom.env().observation_space("meta_0"), EscapeRoom().observation_space):
        assert isinstance(space, gymnasium.spaces.Dict)
        torch.nn.ModuleDict({name: torch.nn.Identity() for name in space})


def test_observe_accepts_only_the_two_agents():
    env = hierroom.raw_env(graph="a", size=11)
    env.reset(seed=0)
    with pytest.raises(InputError, match=r"^the agents are meta_0 and controller_0; there is no 'player_7'$"):
        env.observe("player_7")
