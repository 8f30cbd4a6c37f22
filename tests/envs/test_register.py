"""Gymnasium ids, also for custom goal graphs, in this process and in others, and their specs."""

import sys
import warnings

import gymnasium
import numpy as np
import pettingzoo
import pytest
from gymnasium.envs.registration import EnvSpec

import hierroom
from hierroom import GoalGraph, InputError
from hierroom.gym_env import EscapeRoom
from hierroom.vector_env import EscapeRooms

ROOM = "hierroom/EscapeRoom-b-v0"
FORK = GoalGraph((0, 1, 1), 3, label="fork")
MODULE = """import hierroom

hierroom.register("fork", hierroom.GoalGraph((0, 1, 1), 3, label="fork"))
"""


REGISTRIES = [gymnasium.registry, *(vars(pettingzoo).get(f"{kind}_registry", {}) for kind in ("aec", "parallel"))]


@pytest.fixture(autouse=True)
def unregistered():
    before = [dict(registry) for registry in REGISTRIES]
    yield
    for registry, entries in zip(REGISTRIES, before, strict=True):
        registry.clear()
        registry.update(entries)


@pytest.mark.skipif(not hasattr(pettingzoo, "make"), reason="PettingZoo has make from 1.27 on")
@pytest.mark.parametrize("kind", ["aec", "parallel"])
def test_pettingzoo_make_knows_the_same_ids(kind):
    env_id = hierroom.register("fork", FORK)
    assert pettingzoo.make(kind, env_id, max_steps=7).unwrapped.complexity.graph == FORK
    ours = {name for name in gymnasium.registry if name.startswith("hierroom/")}
    assert ours == {name for name in vars(pettingzoo)[f"{kind}_registry"] if name.startswith("hierroom/")}


def test_register_takes_a_graph_file(tmp_path):
    path = tmp_path / "fork.toml"
    FORK.to_toml(path)
    assert hierroom.register("abc", path) == "hierroom/EscapeRoom-abc-v0"
    assert hierroom.register("my-fork_2.0", path) == "hierroom/EscapeRoom-my-fork_2.0-v0"
    path.unlink()  # it was read when it was registered
    env = gymnasium.make("hierroom/EscapeRoom-my-fork_2.0-v0", size=13)
    assert env.unwrapped.complexity.graph == FORK
    assert env.unwrapped.complexity.graph.name == "fork"
    env.reset(seed=0)
    envs = gymnasium.make_vec("hierroom/EscapeRoom-my-fork_2.0-v0", num_envs=3)
    assert envs.unwrapped.complexity.graph == FORK
    assert '"name": "fork"' in env.spec.to_json()


@pytest.mark.parametrize("make", [gymnasium.make, gymnasium.make_vec])
def test_an_id_refuses_other_graphs_and_exclusions(make):
    env_id = hierroom.register("three-rooms", "rooms:3", exclude="c")
    for name, value in (("exclude", ()), ("graph", ["rooms:3", "d"])):
        with pytest.raises(InputError, match=rf"^{env_id} has its own graphs: give {name} .*/EscapeRoom-v0$"):
            make(env_id, **{name: value})
    assert make(env_id, graph="rooms:3", exclude=["c"]).spec.id == env_id
    with pytest.raises(InputError, match=r"^hierroom/EscapeRoom-b-v0 has its own graphs: give graph 'f' to "):
        make("hierroom/EscapeRoom-b-v0", graph="f")
    assert make("hierroom/EscapeRoom-b-v0", graph="b").spec.id == "hierroom/EscapeRoom-b-v0"


@pytest.mark.parametrize("graph", [FORK, GoalGraph((0, 1, 1), 3), ["a", FORK]])
def test_spec_from_json_makes_the_same_environment(graph):
    env = gymnasium.make("hierroom/EscapeRoom-v0", graph=graph)
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    everything = [one.unwrapped.single.turns.world.sampler.everything for one in (env, again)]
    assert everything[0] == everything[1]
    assert [one.name for one in everything[0]] == [one.name for one in everything[1]]


@pytest.mark.slow
def test_registering_module_is_imported_in_other_processes(tmp_path, monkeypatch):
    (tmp_path / "rooms_of_mine.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)  # a spawned process has the same path
    env_id = "rooms_of_mine:hierroom/EscapeRoom-fork-v0"
    envs = gymnasium.make_vec(
        env_id, num_envs=2, size=11, vectorization_mode="async", vector_kwargs={"context": "spawn"}
    )
    try:
        observations, _ = envs.reset(seed=3)
    finally:
        envs.close()
    sync = gymnasium.make_vec(env_id, num_envs=2, size=11, vectorization_mode="sync")
    expected, _ = sync.reset(seed=3)
    np.testing.assert_array_equal(observations["observation"], expected["observation"])
    assert sync.envs[0].unwrapped.complexity.graph == FORK
    sys.modules.pop("rooms_of_mine")


def test_register_warns_only_if_the_graph_changes():
    hierroom.register("fork", FORK)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hierroom.register("fork", FORK)
    with pytest.warns(UserWarning, match="Overriding environment hierroom/EscapeRoom-fork-v0") as warned:
        hierroom.register("fork", "a")
    assert len(warned) == 1


@pytest.mark.parametrize("name", ["", "a", "g", "my rooms", "my/rooms", "my:rooms", "-x", "ü", 3, None])
def test_an_invalid_name_raises_input_error(name):
    with pytest.raises(InputError) as caught:
        hierroom.register(name, FORK)
    assert str(caught.value) == (
        "the name of an environment must be letters, digits, _, . and -, and not one of the letters "
        f"a, b, c, d, e, f, g, which are the paper's graphs; not {name!r}"
    )


@pytest.mark.parametrize("drop_key", [False, True])
def test_action_masks_method_equals_the_observed_mask(drop_key):
    env = gymnasium.make(ROOM, size=11, drop_key=drop_key)
    observation, _ = env.reset(seed=0)
    masks = env.get_wrapper_attr("action_masks")()
    assert masks.dtype == bool
    assert masks.tolist() == observation["action_mask"].astype(bool).tolist() == [True] * (5 + drop_key)


def test_spec_has_the_step_limit():
    env = gymnasium.make(ROOM, max_steps=77)
    assert env.spec.max_episode_steps == 77
    assert env.unwrapped.spec.max_episode_steps == 77
    assert gymnasium.make_vec(ROOM, 2, max_steps=77).spec.max_episode_steps == 77
    assert EscapeRoom("f").spec is EscapeRooms(2, "f").spec is None
    again = gymnasium.make(env.spec)
    assert again.spec.max_episode_steps == 77
    assert '"max_episode_steps": 77' in env.spec.to_json()
    again.reset(seed=0)
    ends = [again.step(1)[2:4] for _ in range(77)]
    assert ends == [(False, False)] * 76 + [(False, True)]


def test_make_vec_takes_specs_and_the_smaller_limit():
    single = gymnasium.make(ROOM, max_steps=7)
    many = gymnasium.make_vec(ROOM, 2, max_steps=7)
    shorter = gymnasium.make_vec(ROOM, 2, max_episode_steps=7)
    longer = gymnasium.make_vec(ROOM, 2, max_steps=7, max_episode_steps=9)
    for envs in (gymnasium.make_vec(single.spec, 2), gymnasium.make_vec(many.spec), shorter, longer):
        assert envs.spec.max_episode_steps == 7
        envs.reset(seed=0)
        assert [envs.step([1, 1])[3].all() for _ in range(7)] == [False] * 6 + [True]
    for wrong in (0, "7", 7.0):
        with pytest.raises(InputError, match="max_episode_steps must be"):
            gymnasium.make_vec(ROOM, 2, max_episode_steps=wrong)
