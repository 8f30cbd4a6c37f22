"""What the checkers of PettingZoo and Gymnasium do not look at."""

import copy
import itertools

import gymnasium
import numpy as np
import pytest
import torch

import hierroom
from hierroom.gym_env import EscapeRoom
from hierroom.support.errors import InputError
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.escape_room.oracle import shortest_actions

AGENTS = ["meta_0", "controller_0"]


def play(env, rng, episodes):
    """Random legal play of an AEC environment: everything that ``last`` said, and what was done."""
    told = []
    for _ in range(episodes):
        for agent in env.agent_iter():
            observation, reward, terminated, truncated, info = env.last()
            action = None
            if not (terminated or truncated):
                action = int(rng.choice(np.flatnonzero(observation["action_mask"])))
            told.append((agent, observation, reward, terminated, truncated, copy.deepcopy(info), action))
            env.step(action)
        env.reset()
    return told


def equal(one, other):
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(equal(one[key], other[key]) for key in one)
    if isinstance(one, (tuple, list)):
        return len(one) == len(other) and all(equal(a, b) for a, b in zip(one, other, strict=True))
    if isinstance(one, np.ndarray) and one.dtype == object:
        return equal([*one], [*other])
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other)
    return type(one) is type(other) and one == other


def make(seed, **settings):
    env = hierroom.env(**{"graph": "d", "size": 11, "max_steps": 60, "drop_key": True, **settings})
    env.reset(seed=seed)
    return env


def test_fifty_episodes_are_the_same_again_and_other_seeds_are_others():
    told, again, other = (play(make(seed), np.random.default_rng(0), 50) for seed in (3, 3, 4))
    assert len(told) > 50 * 60
    assert equal(told, again)
    assert not equal(told[0], other[0])
    starts = {repr(entry[1]) for entry in told if entry[0] == "meta_0" and entry[5]["elapsed"] == 0}
    assert len(starts) > 25


def test_an_episode_of_five_options_has_two_agents():
    env = make(1, subgoal_horizon=4, max_steps=20)
    told = play(env, np.random.default_rng(0), 1)
    turns = [entry for entry in told if entry[0] == "meta_0" and entry[-1] is not None]
    assert len(turns) == 5
    assert {entry[0] for entry in told} == set(AGENTS) == set(env.possible_agents)
    assert [entry[5]["elapsed"] for entry in turns] == [0, 4, 4, 4, 4]
    assert {entry[5]["elapsed"] for entry in told if entry[0] == "controller_0"} == {0, 1}


@pytest.mark.parametrize("max_steps", [15, 400])
def test_both_agents_end_on_the_same_step(max_steps):
    for seed in range(8):
        env = make(seed, graph="a", max_steps=max_steps)
        told = play(env, np.random.default_rng(seed), 1)
        *before, meta, controller = told
        assert [meta[0], controller[0]] == AGENTS
        assert meta[3:5] == controller[3:5]
        assert not any(entry[3] or entry[4] for entry in before)
        assert meta[5]["success"] is meta[3]
        assert meta[5]["length"] == sum(entry[0] == "controller_0" for entry in before)


def test_flags_rewards_and_infos_are_plain_python():
    for entry in play(make(2, reward="bonus"), np.random.default_rng(0), 2):
        assert [type(value) for value in entry[2:5]] == [float, bool, bool]
        assert {type(value) for value in entry[5].values()} <= {int, bool}
    env = hierroom.parallel_env(size=11, max_steps=5)
    env.reset(seed=0)
    for _ in range(5):
        assert env.agents == AGENTS
        _, rewards, terminations, truncations, infos = env.step({"meta_0": 13, "controller_0": 0})
        assert {type(value) for value in rewards.values()} == {float}
        assert {type(value) for value in (*terminations.values(), *truncations.values())} == {bool}
        assert {type(value) for info in infos.values() for value in info.values()} <= {int, bool}
    assert env.agents == []
    env = EscapeRoom(size=11)
    env.reset(seed=0)
    _, *results, info = env.step(0)
    assert [type(value) for value in results] == [float, bool, bool]
    assert {type(value) for value in info.values()} <= {int, bool}


INFO = {
    "goal_event": int,
    "elapsed": int,
    "illegal_actions": int,
    "success": bool,
    "length": int,
    "shortest_length": int,
}


def test_infos_have_the_same_keys_and_types_at_every_moment():
    """Libraries make room for infos at reset, and for these only."""
    aec, parallel, single = make(0, max_steps=6), hierroom.parallel_env(size=11, max_steps=6), EscapeRoom(max_steps=6)
    told = [info for entry in play(aec, np.random.default_rng(0), 3) for info in (entry[5],)]
    for _ in range(3):
        told += parallel.reset()[1].values()
        told.append(single.reset()[1])
        for t in range(6):
            told += (infos := parallel.step({"meta_0": 13, "controller_0": 1})[4]).values()
            told.append(single.step(1)[4])
            assert {info["length"] for info in (*infos.values(), told[-1])} == {t + 1}
    assert all({name: type(value) for name, value in info.items()} == INFO for info in told)
    assert all(info["shortest_length"] > 0 and not info["success"] for info in told)


def test_spaces_are_the_same_objects_at_every_call():
    for env in (hierroom.env(), hierroom.raw_env(), hierroom.parallel_env()):
        for agent in AGENTS:
            assert env.observation_space(agent) is env.observation_space(agent)
            assert env.action_space(agent) is env.action_space(agent)


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


APIS = {
    "parallel": lambda: hierroom.parallel_env(graph="a", size=11, max_steps=25, subgoal_horizon=6),
    "gymnasium": lambda: EscapeRoom("a", meta="fixed-dfs", size=11, max_steps=25),
    "vector": lambda: EscapeRooms(3, "a", meta="fixed-dfs", size=11, max_steps=25),
}


def advance(env, rng):
    if hasattr(env, "possible_agents"):
        if not env.agents:
            return env.reset()
        return env.step({"meta_0": int(rng.integers(14)), "controller_0": int(rng.integers(5))})
    actions = rng.integers(5, size=getattr(env, "num_envs", None))
    result = env.step(actions)
    return env.reset() if isinstance(env, EscapeRoom) and (result[2] or result[3]) else result


@pytest.mark.parametrize("api", APIS)
def test_returned_arrays_belong_to_the_caller(api):
    env, twin = APIS[api](), APIS[api]()
    rng, twin_rng = np.random.default_rng(0), np.random.default_rng(0)
    spoil(env.reset(seed=7, options={"complexity": True}))
    twin.reset(seed=7)
    kept = []
    for _ in range(120):
        told, expected = advance(env, rng), advance(twin, twin_rng)
        assert equal(told, expected)
        arrays = [*arrays_of(told)]
        assert not any(np.shares_memory(one, other) for one, other in itertools.combinations(arrays, 2))
        spoil(told)
        kept.append((expected, copy.deepcopy(expected)))
    assert equal(*map(list, zip(*kept, strict=True)))


def test_reset_takes_any_options_and_tells_complexity_if_asked():
    env = make(0)
    env.reset(seed=1, options={"colour": "mauve"})
    assert "complexity" not in env.last()[-1]
    env.reset(seed=1, options={"complexity": True})
    assert env.last()[-1]["complexity"] == env.unwrapped.complexity.to_dict()
    assert env.unwrapped.complexity.exit_depth == 2
    env.step(13)
    assert "complexity" not in env.last()[-1]
    for made in (hierroom.parallel_env(), EscapeRoom()):
        _, info = made.reset(seed=1, options={"complexity": True, "colour": "mauve"})
        assert made.complexity.to_dict() in (info.get("complexity"), info.get("meta_0", {}).get("complexity"))


def test_arguments_reach_the_level():
    env = hierroom.parallel_env(graph="g", size=15, max_steps=7, drop_key=True, goal_mask="none")
    observations, _ = env.reset(seed=0)
    assert env.action_space("controller_0").n == 6
    assert observations["meta_0"]["action_mask"].tolist() == [1] * 13 + [0]
    state = env.single.turns.world.state
    assert (state.size, state.levels[0].max_steps, state.levels[0].n_rooms) == (15, 7, 4)


def test_the_end_is_told_with_the_shortest_length():
    env = hierroom.parallel_env(graph="f")
    env.reset(seed=0)
    path = shortest_actions(env.single.turns.world.get_state())
    for action in (1, 2, *path):  # a turn to the left and back, then the shortest way
        assert env.agents == AGENTS
        *_, infos = env.step({"meta_0": 13, "controller_0": action})
    for info in infos.values():
        assert (info["success"], info["length"], info["shortest_length"]) == (True, len(path) + 2, len(path))


def test_unseeded_environments_differ_and_go_on_to_the_next_episode():
    """Five episodes each, as two can begin with the same view."""
    for make_one in (hierroom.parallel_env, EscapeRoom, lambda: EscapeRooms(4)):
        several = []
        for _ in range(6):
            env = make_one()
            several.append([repr(env.reset()[0]) for _ in range(5)])
        assert len({episodes[0] for episodes in several}) > 3
        assert all(len(set(episodes)) > 2 for episodes in several)


def test_an_entry_of_an_observation_can_name_a_torch_module():
    """Libraries make a module for each entry; one named as a method of `ModuleDict`, such as keys, breaks them."""
    for space in (hierroom.env().observation_space("meta_0"), EscapeRoom().observation_space):
        assert isinstance(space, gymnasium.spaces.Dict)
        torch.nn.ModuleDict({name: torch.nn.Identity() for name in space})


def test_nobody_observes_but_the_two_agents():
    env = hierroom.raw_env(graph="a", size=11)
    env.reset(seed=0)
    with pytest.raises(InputError, match=r"^the agents are meta_0 and controller_0; there is no 'player_7'$"):
        env.observe("player_7")


def test_values_returned_by_the_aec_environment_belong_to_the_caller():
    env, twin = make(7), make(7)
    rng = np.random.default_rng(0)
    kept = []
    for _ in range(150):
        told, expected = env.last(), twin.last()
        assert equal(told, expected)
        kept.append((expected, copy.deepcopy(expected)))
        kept.append((twin.rewards, twin.rewards.copy()))
        action = None if told[2] or told[3] else int(rng.integers(env.action_space(env.agent_selection).n))
        spoil(told)
        spoil(env.observe("meta_0"))
        env.step(action)
        twin.step(action)
        if not env.agents:
            env.reset()
            twin.reset()
    live = [pair for pair in kept if len(pair[0])]  # PettingZoo itself takes ended agents out of its dicts
    assert equal(*map(list, zip(*live, strict=True)))
