"""Observations of the controller in episodes, and episodes as a Minari data set."""

import sys
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from odd_names import counter

import hierroom
from hierroom.support.errors import InputError
from hierroom.worlds.env_config import EnvConfig


@pytest.mark.parametrize("config", [EnvConfig("c", max_steps=50), EnvConfig(task="workshop:6", max_steps=20)])
def test_rollout_observations_equal_those_of_the_environment(config):
    player = hierroom.load("c") if config.task is None else "random"
    episodes = list(hierroom.rollout(player, config, 7, num_envs=3, seed=4, observations=True))
    assert {episode.number for episode in episodes} == {0, 1, 2}
    assert {episode.success for episode in episodes} == ({True, False} if config.task is None else {False})
    for episode in episodes:
        entries = vars(config) | {"env_index": episode.env, "levels": "evaluation"}
        env = gymnasium.make("hierroom/EscapeRoom-v0", meta="none" if type(player) is str else "fixed-dfs", **entries)
        observation, _ = env.reset(seed=4)
        for _ in range(episode.number):
            observation, _ = env.reset()
        seen = [observation]
        for action in episode.actions:
            observation, *_ = env.step(action)
            seen.append(observation)
        assert episode.observations is not None
        assert episode.observations.keys() == env.observation_space.spaces.keys()
        for name, values in episode.observations.items():
            np.testing.assert_array_equal(values, np.stack([one[name] for one in seen]), err_msg=name)
            assert values.dtype == env.observation_space[name].dtype
    (without,) = hierroom.rollout("random", config, 1)
    assert without.observations is None


@pytest.mark.filterwarnings("ignore")
def test_minari_dataset_has_episodes_and_recovers_their_environment(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    pytest.importorskip("h5py")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    agent, config = hierroom.load("c"), EnvConfig("c", max_steps=50, reward="extrinsic")
    hierroom.minari_dataset("hierroom/c/hippo-v0", agent, config, 6, num_envs=3, seed=4, author="me")
    expected = list(hierroom.rollout(agent, config, 6, num_envs=3, seed=4, observations=True))
    data = minari.load_dataset("hierroom/c/hippo-v0")
    assert (data.total_episodes, data.total_steps) == (6, sum(map(len, expected)))
    for ours, theirs in zip(expected, data.iterate_episodes(), strict=True):
        np.testing.assert_array_equal(ours.actions, theirs.actions)
        np.testing.assert_array_equal(ours.rewards, theirs.rewards)
        assert [*theirs.terminations[-1:], *theirs.truncations[-1:]] == [ours.terminated, ours.truncated]
        assert not (theirs.terminations[:-1].any())
        assert not (theirs.truncations[:-1].any())
        for name, values in (ours.observations or {}).items():
            np.testing.assert_array_equal(values, theirs.observations[name])
    with pytest.raises(InputError, match="there is a data set hierroom/c/hippo-v0 already"):
        hierroom.minari_dataset("hierroom/c/hippo-v0", agent, config, 6)
    with pytest.raises(InputError, match="Minari takes no data set of this name"):
        hierroom.minari_dataset("no version", agent, config, 6)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("player", "config"),
    [
        ("c", EnvConfig("c", max_steps=50, reward="extrinsic")),
        ("random", EnvConfig(task="workshop:4", max_steps=30)),
        ("random", EnvConfig(task="odd_names:counter", max_steps=4, levels="training")),
    ],
)
def test_minari_dataset_recovers_its_environment(player, config, tmp_path, monkeypatch):
    pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    agent = player if player == "random" else hierroom.load(player, meta="random")
    data = hierroom.minari_dataset("mine-v0", agent, config, 2)
    env = data.recover_environment().unwrapped
    given = {"reward": config.reward or "intrinsic", "levels": config.levels or "evaluation"}
    assert env.config == replace(config, **given)
    assert type(env.meta).__name__ == ("NoGoals" if player == "random" else "RandomGoals")


@pytest.mark.filterwarnings("ignore")
def test_minari_dataset_says_what_it_cannot_recover(tmp_path, monkeypatch):
    pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    data = hierroom.minari_dataset("task-v0", "random", EnvConfig(task=counter, max_steps=4), 2, description="Mine.")
    assert data.spec.env_spec is None
    about = data.storage.metadata["description"]
    assert about == "Mine. The environment cannot be recovered: its task is an object, not a name."
    data = hierroom.minari_dataset("learned-v0", hierroom.load("learned-g"), EnvConfig("a", size=11, max_steps=9), 1)
    assert data.storage.metadata["description"].startswith("A recovered environment has no goals: ")


def test_missing_minari_raises_input_error(monkeypatch):
    monkeypatch.setitem(sys.modules, "minari", None)
    with pytest.raises(InputError, match=r"^to write a Minari data set install minari"):
        hierroom.minari_dataset("hierroom/c/hippo-v0", "random")
