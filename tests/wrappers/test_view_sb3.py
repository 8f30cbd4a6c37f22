"""The Stable-Baselines3 view: the same as Stable-Baselines3's own vector of our environments, faster."""

import re
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers.vector import RecordEpisodeStatistics
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecMonitor

import hierroom
from hierroom import InputError

N = 6
SETTINGS = {"size": 11, "max_steps": 40, "reward": "bonus", "meta": "fixed-dfs"}


def make(**settings):
    return hierroom.sb3_view(gymnasium.make_vec("hierroom/EscapeRoom-b-v0", N, **{**SETTINGS, **settings}))


def plain_envs():
    return [gymnasium.make("hierroom/EscapeRoom-b-v0", **SETTINGS, env_index=n) for n in range(N)]


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_each_step_equals_the_single_environments(mode):
    envs, singles, rng = make(autoreset_mode=mode), plain_envs(), np.random.default_rng(0)
    envs.seed(3)
    observations, expected = envs.reset(), [single.reset(seed=3) for single in singles]
    assert envs.reset_infos == [info for _, info in expected]
    n_ended = 0
    for _ in range(150):
        for n, (observation, _) in enumerate(expected):
            assert observations.keys() == observation.keys()
            for name, values in observation.items():
                np.testing.assert_array_equal(observations[name][n], values)
        np.testing.assert_array_equal(envs.action_masks(), observations["action_mask"])
        actions = rng.integers(5, size=N)
        observations, rewards, dones, infos = envs.step(actions)
        assert rewards.dtype == np.float32
        for n, single in enumerate(singles):
            observation, reward, terminated, truncated, info = single.step(int(actions[n]))
            assert (rewards[n], dones[n]) == (reward, terminated or truncated)
            expected[n] = observation, info
            if dones[n]:
                n_ended += 1
                last = infos[n].pop("terminal_observation")
                for name, values in observation.items():
                    np.testing.assert_array_equal(last[name], values)
                assert infos[n].pop("TimeLimit.truncated") == (truncated and not terminated)
                assert infos[n].pop("is_success") == terminated
                assert infos[n] == info
                expected[n] = single.reset()
                assert envs.reset_infos[n] == expected[n][1]
            else:
                assert infos[n] == info
    assert n_ended >= 3 * N


def test_render_equals_the_wrapped_environments():
    envs = make(render_mode="rgb_array")
    envs.reset()
    assert envs.render().shape[-1] == 3  # all in one
    images = envs.get_images()
    assert len(images) == N
    np.testing.assert_array_equal(images[2], envs.envs.render()[2])
    texts = make(render_mode="ansi")
    texts.reset()
    assert texts.render() is None
    assert texts.env_method("render", indices=[1]) == [texts.envs.render()[1]]
    assert texts.get_images() == [None] * N


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_infos_have_episode_statistics_at_the_end(mode):
    envs = gymnasium.make_vec("hierroom/EscapeRoom-b-v0", N, autoreset_mode=mode, **SETTINGS)
    envs = hierroom.sb3_view(RecordEpisodeStatistics(envs))
    envs.reset()
    lengths, n_ended, rng = np.zeros(N, int), 0, np.random.default_rng(0)
    for _ in range(90):
        _, _, dones, infos = envs.step(rng.integers(5, size=N))
        lengths += 1
        for n, info in enumerate(infos):
            assert ("episode" in info) == dones[n] == ("terminal_observation" in info)
            if dones[n]:
                assert info["episode"]["l"] == info["length"] == lengths[n]
                lengths[n], n_ended = 0, n_ended + 1
    assert n_ended >= 2 * N


@pytest.mark.usefixtures("one_thread")
def test_stable_baselines3_ppo_trains_and_evaluates():
    envs = VecMonitor(make())
    model = PPO("MultiInputPolicy", envs, n_steps=32, batch_size=64, n_epochs=1, device="cpu", seed=0)
    before = [parameter.clone() for parameter in model.policy.parameters()]
    model.learn(3 * 32 * N)
    assert model.num_timesteps == 3 * 32 * N
    assert all((old != new).any() for old, new in zip(before, model.policy.parameters(), strict=True))
    assert all(0 < info["l"] <= 40 for info in model.ep_info_buffer)
    assert len(model.ep_info_buffer) == len(model.ep_success_buffer) > 0
    mean, _ = evaluate_policy(model, envs, n_eval_episodes=4, deterministic=False)
    assert 0 <= mean <= 5


def test_missing_stable_baselines3_raises_input_error(monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    for name in [name for name in sys.modules if name.startswith("stable_baselines3.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, "hierroom.wrappers.sb3", raising=False)
    with pytest.raises(InputError, match=r"^sb3_view needs Stable-Baselines3: pip install stable-baselines3$"):
        make()


@pytest.mark.parametrize(
    ("attempt", "said"),
    [
        (lambda: hierroom.sb3_view(hierroom.env()), "sb3_view takes what gymnasium.make_vec gives for an id"),
        (lambda: hierroom.sb3_view(gymnasium.make_vec("CartPole-v1", 2)), "sb3_view takes what gymnasium.make_vec"),
        (lambda: make(copy=False), "sb3_view takes environments with copy=True: Stable-Baselines3 keeps observations"),
        (lambda: make().set_attr("graph", "c"), "the environments of the batch engine have no attributes of their own"),
    ],
)
def test_invalid_uses_raise_input_error(attempt, said):
    with pytest.raises(InputError, match=f"^{re.escape(said)}") as caught:
        attempt()
    assert "\n" not in str(caught.value)
