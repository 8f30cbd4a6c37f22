"""What each API takes, and invalid arguments and calls, which raise one-line errors and change nothing."""

import inspect
import re
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
from hierroom.gym_env import EscapeRoom
from hierroom.turns.turns import Turns
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.env_config import EnvConfig


@pytest.mark.parametrize("api", [hierroom.env, hierroom.raw_env, hierroom.parallel_env, EscapeRoom, EscapeRooms])
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"graph": "h"}, "a graph must be a letter from a to g, a name such as keys-0-1-exit-2, a GoalGraph or a path"),
        ({"graph": hierroom.GoalGraph((0,) * 7, 1)}, "a grid holds at most 7 rooms"),
        ({"size": 10}, "size must be a whole number from 11 to 63, not 10"),
        ({"max_steps": 0}, "max_steps must be a whole number"),
        ({"reward": "handsome"}, "a reward is one of extrinsic, bonus, intrinsic, "),
        ({"goal_mask": "all"}, "goal_mask must be one of reachable, existing, seen, none, not 'all'"),
        ({"subgoal_horizon": 0}, "subgoal_horizon must be a whole number from 1 to 2**62 - 1 or None, not 0"),
        ({"novelty_bonus": 10**400}, "novelty_bonus must be a number from 0 to 1,000,000, not 1000"),
        ({"levels": "test"}, "levels must be one of training, evaluation or None, not 'test'"),
        ({"env_index": -1}, "env_index must be a whole number from 0 to 2**62 - 1, not -1"),
        ({"drop_key": "no"}, "drop_key must be True or False, not 'no'"),
        ({"curriculum_stages": 2, "graph": "b"}, "a curriculum of 2 stages needs several graphs, as of rooms:4, not b"),
        ({"curriculum_stages": 0}, "curriculum_stages must be a whole number from 1 to 2**62 - 1, not 0"),
    ],
)
def test_invalid_arguments_raise_input_error(api, arguments, said):
    with pytest.raises(InputError, match=f"^{re.escape(said)}") as caught:
        api(**arguments)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("attempt", "said"),
    [
        (lambda: hierroom.env(render_mode="oil"), "render_mode must be one of ansi, rgb_array, human or None, not "),
        (
            lambda: gymnasium.make_vec("hierroom/EscapeRoom-a-v0", 0),
            "num_envs must be a whole number from 1 to 1048576",
        ),
        (
            lambda: gymnasium.make_vec("hierroom/Task-v0", 10**9, task="workshop:3"),
            "num_envs must be a whole number from 1 to",
        ),
        (lambda: hierroom.raw_env().reset(seed=-1), "a seed must be a whole number from 0 to 2**63 - 1, not -1"),
        (lambda: EscapeRooms(2).reset(seed=[1, -2]), "a seed must be a whole number from 0 to 2**63 - 1, not -2"),
        (lambda: EscapeRooms(2).reset(seed=[1]), "seeds are one for all environments or 2 of them, not 1"),
        (lambda: step_aec_env(13, 1.5), "an action must be a whole number, not 1.5"),
        (lambda: step_aec_env(None), "meta_0 must act; None is for agents with an ended episode"),
        (lambda: vector_env_after_reset().step([0, 0, 0]), "actions must be 2 whole numbers"),
        (lambda: vector_env_after_reset().step([[0], [1, 2]]), "actions must be 2 whole numbers"),
        (lambda: step_parallel_env({"meta_0": 13, "controller_0": None}), "an action must be a whole number, not None"),
        (lambda: EscapeRooms(2).reset(seed=0, options=[1]), "options of a reset are a dict or None, not a list"),
        (lambda: EscapeRooms(2).step([0, 0]), "reset the environment before its first step"),
        (lambda: hierroom.parallel_env().step({}), "reset the environment before its first step"),
        (lambda: hierroom.raw_env().last(), "reset the environment before its first step"),
        (lambda: aec_env_after_its_end().step(0), "the episode has ended and no agent is left: reset the environment"),
        (lambda: aec_env_after_its_end().last(), "the episode has ended and no agent is left: reset the environment"),
        (lambda: EscapeRoom().render(), "reset the environment before"),
        (lambda: step_parallel_env([0, 1]), "actions are a dict by agent, not a list"),
        (lambda: EscapeRooms(2, copy="no"), "copy must be True or False, not 'no'"),
        (
            lambda: step_parallel_env({"meta_0": 13, "controller_0": 0, "x": 0}),
            "the agents are meta_0 and controller_0",
        ),
        (lambda: step_parallel_env({"meta_0": 13}), "a step needs an action of each agent, and has none of control"),
    ],
)
def test_invalid_calls_raise_input_error(attempt, said):
    with pytest.raises(InputError, match=f"^{re.escape(said)}") as caught:
        attempt()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("action", [2**63, 2**64, 10**30, -(2**63) - 1, np.uint64(2**64 - 1), np.array(2**63)])
def test_huge_number_is_an_illegal_action(action):
    env = hierroom.parallel_env()
    env.reset(seed=0)
    *_, infos = env.step({"meta_0": action, "controller_0": action})
    assert [infos[agent]["illegal_actions"] for agent in ("meta_0", "controller_0")] == [1, 1]
    turns = env.single.turns
    assert turns.world.state.levels["steps"][0] == turns.ledger.option_steps[0] == 1


def test_parallel_step_with_one_invalid_action_changes_nothing():
    env = hierroom.parallel_env()
    env.reset(seed=0)
    before = env.single.turns.get_state()
    with pytest.raises(InputError, match=r"^an action must be a whole number, not 0\.5$"):
        env.step({"meta_0": 13, "controller_0": 0.5})
    for name, array in env.single.turns.get_state().items():
        np.testing.assert_array_equal(array, before[name], err_msg=name)


def test_refused_action_loses_no_reward_in_aec():
    env = hierroom.raw_env("a", size=11, reward=lambda step: np.ones(1))
    env.reset(seed=0)
    env.step(env.observe("meta_0")["action_mask"].argmax())
    env.step(1)
    for action in ("left", None):
        with pytest.raises(InputError):
            env.step(action)
        assert (env.agent_selection, env.last()[1]) == ("controller_0", 1.0)


def aec_env_after_its_end():
    env = hierroom.raw_env(max_steps=1)
    env.reset(seed=0)
    for action in (13, 0, None, None):
        env.step(action)
    return env


def step_parallel_env(actions):
    env = hierroom.parallel_env()
    env.reset(seed=0)
    env.step(actions)


def vector_env_after_reset():
    envs = EscapeRooms(2)
    envs.reset(seed=0)
    return envs


def step_aec_env(*actions):
    env = hierroom.raw_env()
    env.reset(seed=0)
    for action in actions:
        env.step(action)


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


def test_env_config_takes_numpy_numbers():
    config = EnvConfig("c", env_index=np.int64(3), subgoal_horizon=np.int32(5), drop_key=np.bool_(True))
    assert Turns(config, seed=0).world.state.levels["index"].tolist() == [3]


def test_docstrings_name_every_env_config_entry():
    assert hierroom.env.__name__ == "env"
    assert "checks of order and bounds" in hierroom.env.__doc__
    for made in (hierroom.raw_env, hierroom.parallel_env, EscapeRoom, EscapeRooms):
        assert "other entries of the `EnvConfig`" in inspect.cleandoc(made.__doc__)
    for name in vars(EnvConfig()):
        assert f"    {name}: " in inspect.cleandoc(EnvConfig.__doc__)


def test_package_exports_its_public_names():
    assert set(hierroom.__all__) <= set(dir(hierroom))
    assert callable(hierroom.parallel_env)
    import hierroom.parallel_env as module_or_class

    assert hierroom.parallel_env is module_or_class
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = hierroom.nothing
