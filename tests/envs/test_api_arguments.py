"""The arguments of all APIs: each lists every entry of `EnvConfig`, refuses others, and takes every kind of graph."""

import inspect
from dataclasses import fields
from functools import partial
from pathlib import Path

import chest_task
import gymnasium
import numpy as np
import pytest
from fuzz.apis import ID, NATIVE

import hierroom
from hierroom import GoalGraph, InputError
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.env_config import EnvConfig

MADE = {
    **NATIVE,
    "make": partial(gymnasium.make, ID),
    "make_vec": partial(gymnasium.make_vec, ID, num_envs=2),
    "make_vec sync": partial(gymnasium.make_vec, ID, num_envs=2, vectorization_mode="sync"),
}
CONFIG = [field.name for field in fields(EnvConfig)]
ROW = GoalGraph((0, 1, 2, 3), 4)


@pytest.mark.parametrize("api", NATIVE)
def test_each_api_has_its_default_reward(api):
    expected = "extrinsic" if api.startswith("Escape") else "intrinsic"
    assert turns_of(NATIVE[api]()).config == EnvConfig(reward=expected)


@pytest.mark.parametrize("api", MADE)
def test_unknown_keyword_raises_input_error(api):
    native = {"make": "EscapeRoom", "make_vec": "EscapeRooms", "make_vec sync": "EscapeRoom"}.get(api, api)
    besides = inspect.signature(NATIVE["raw_env" if native == "env" else native]).parameters
    known = ", ".join([*CONFIG, *(name for name in besides if name not in ("num_envs", "graph", "entries"))])
    for wrong in ({"pay": "bonus"}, {"room_index": 3, "colour": "mauve"}):
        with pytest.raises(InputError) as caught:
            MADE[api](**wrong)
        assert str(caught.value) == f"an environment takes {known}; not {', '.join(wrong)}"


def test_graph_and_task_together_raise_input_error():
    with pytest.raises(InputError, match="graph and task are two tasks; for a task of your own use hierroom/Task-v0"):
        gymnasium.make("hierroom/Workshop-v0", graph=chest_task.chest)


def first(env):
    """Return the environment without wrappers; if Gymnasium made several, return the first."""
    return (env.envs[0] if isinstance(env, gymnasium.vector.SyncVectorEnv) else env).unwrapped


def turns_of(env):
    made = first(env)
    return made.turns if isinstance(made, EscapeRooms) else made.single.turns


def graphs_of(env, n_episodes=12):
    graphs = []
    for seed in [3] + [None] * (n_episodes - 1):
        env.reset(seed=seed)
        graphs.append(turns_of(env).situation(np.arange(1)).graph(0))
    return graphs


@pytest.fixture
def row_file(tmp_path):
    path = tmp_path / "row.toml"
    path.write_text("key_rooms = [0, 1, 2, 3]\nexit_room = 4\n")
    return path


@pytest.mark.parametrize("api", MADE)
def test_each_api_takes_a_graph_in_every_form(api, row_file):
    ways = [("f", GoalGraph.named("f")), (ROW, ROW), (str(row_file), ROW), (Path(row_file), ROW)]
    for graph, expected in ways:
        env = MADE[api](graph=graph, size=15)
        assert graphs_of(env, 2) == [expected] * 2
        assert turns_of(env).world.complexity.graph == expected
        env.close()


@pytest.mark.parametrize("api", MADE)
def test_each_api_takes_several_graphs_and_exclusions(api, row_file):
    expected = graphs_of(hierroom.parallel_env(["a", "c", row_file, "f"], exclude="f"))
    assert set(expected) == {GoalGraph.named("a"), GoalGraph.named("c"), ROW}
    for graph, exclude in ((["a", "c", ROW], ()), (("c", "a", str(row_file), "rooms:3"), ["b", GoalGraph((0, 1), 1)])):
        env = MADE[api](graph=graph, exclude=exclude)
        assert graphs_of(env) == expected
        assert turns_of(env).world.complexity.graph == ROW  # the hardest
        assert [graph.name for graph in turns_of(env).world.sampler.everything][:2] == ["a", "c"]
        env.close()
