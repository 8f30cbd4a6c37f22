"""Runs of tasks whose actions are arrays: trained, resumed, played and shown."""

import signal

import dial_tasks
import numpy as np
import pandas as pd
import pytest
import torch
from same_run import differences
from stopped_run import stop_at_update

import hierroom
from hierroom.commands import evaluate, report, watch
from hierroom.gym_env import EscapeRoom
from hierroom.support.errors import InputError
from hierroom.train import main as train
from hierroom.vector_env import EscapeRooms

SMALL = ["--num-envs", "4", "--sequence-length", "16", "--minibatches", "2", "--epochs", "8", "--hidden-size", "8"]
SMALL += ["--steps", "1280", "--evaluations", "2", "--evaluation-episodes", "4", "--threads", "1", "--log", "none"]
KINDS = {"box": [], "multi": [], "binary": ["--memory", "lstm"]}


@pytest.fixture(scope="module", params=["box", *(pytest.param(k, marks=pytest.mark.slow) for k in ("multi", "binary"))])
def run(request, tmp_path_factory):
    out = tmp_path_factory.mktemp("runs") / request.param
    assert train(["--task", f"dial_tasks:{request.param}", *SMALL, *KINDS[request.param], "--out", str(out)]) == 0
    return out


def test_training_turns_the_dials_up(run):
    returns = pd.read_csv(run / "episodes.csv")["return"]
    assert returns[-20:].mean() > returns[:20].mean() + 0.7


def test_stopped_run_resumes_exactly(run, tmp_path, monkeypatch):
    stop_at_update(monkeypatch, signal.SIGINT, 7)  # in the middle of episodes
    out = tmp_path / run.name
    assert train(["--task", f"dial_tasks:{run.name}", *SMALL, *KINDS[run.name], "--out", str(out)]) == 130
    assert train(["--resume", str(out), "--trust-run", "--log", "none"]) == 0
    assert differences(run, out) == []


@pytest.mark.filterwarnings("ignore")
def test_recorded_episode_is_played_again_by_its_actions(run, tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    pytest.importorskip("h5py")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    agent, env = hierroom.load(run, trust=True), EscapeRoom(getattr(dial_tasks, run.name), levels="evaluation")
    episode = next(hierroom.rollout(agent, episodes=1, seed=0))
    env.reset(seed=0)
    for action, reward in zip(episode.actions, episode.extrinsic, strict=True):
        assert env.action_space.contains(action.astype(env.action_space.dtype))
        assert env.step(action)[1] == reward
    assert episode.action_name(1).startswith("action [")
    data = hierroom.minari_dataset("dials/agent-v0", agent, episodes=1, seed=0)
    assert minari.load_dataset("dials/agent-v0").action_space == env.action_space
    np.testing.assert_array_equal(next(data.iterate_episodes()).actions, episode.actions)


@pytest.mark.parametrize("greedy", [False, True])
def test_loaded_agent_acts_in_every_api(run, greedy):
    agent, task = hierroom.load(run, trust=True, greedy=greedy), getattr(dial_tasks, run.name)
    one, many = EscapeRoom(task), EscapeRooms(2, task)
    for env in (hierroom.add_features(one, agent), hierroom.add_features(many, agent)):
        observation, _ = env.reset(seed=0)
        for _ in range(3):
            action, _ = agent.act(observation)
            assert env.action_space.contains(action)
            observation, *_ = env.step(action)
    both = hierroom.add_features(hierroom.parallel_env(task), agent)
    actions, _ = agent.act(both.reset(seed=0)[0])
    assert both.action_space("controller_0").contains(actions["controller_0"])
    for other in {*KINDS} - {run.name}:
        with pytest.raises(InputError, match="with other actions than task"):
            agent.require_world(hierroom.EnvConfig(task=f"dial_tasks:{other}"))


def test_network_gives_the_policy(run):
    agent = hierroom.load(run, trust=True)
    turns, pair = agent.turns(3, seed=1), agent.pair(3)
    features = agent.controller.features.encode(turns.observe("controller_0", np.arange(3)))
    logits, _, _ = agent.network(torch.from_numpy(features), agent.network.initial_state(3))
    pair.step(turns)
    decision = pair.agents["controller_0"].decision
    np.testing.assert_allclose(logits.numpy(force=True), decision.logits, atol=2e-5)
    if run.name == "box":
        with pytest.raises(InputError, match="densities"):
            decision.probabilities  # noqa: B018
    else:
        sizes = agent.controller.features.actions.sizes
        np.testing.assert_allclose(decision.probabilities.sum(axis=1), len(sizes), rtol=1e-6)


def test_commands_show_the_run(run, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert evaluate.main([str(run), "--trust-run", "--episodes", "4"]) == 0
    assert watch.main([str(run), "--trust-run", "--out", "one.json"]) == 0
    assert report.main([str(run), "--trust-run", "--episodes", "1", "--played", "4"]) == 0
    assert "not played" not in capsys.readouterr().out
    assert "action [" in (tmp_path / "one.json").read_text()
