"""Trained runs used with another environment, meta-controller or graph stay unchanged."""

import numpy as np
import pytest

from hierroom.goals import GoalGraph
from hierroom.meta import make_meta
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.run_name import run_name
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trained_agent import load
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.train import main as train
from hierroom.worlds.env_config import EnvConfig

SMALL = TrainConfig(EnvConfig("a", size=11, max_steps=60), num_envs=8).changed(minibatches=2, evaluation_episodes=8)


class Counting:
    """A meta-controller with a memory: how often it was asked."""

    asked = 0

    def choose(self, observations, legal, situation):
        self.asked += 1
        return legal.argmax(axis=1)


class ForSixtyFour:
    """Made for a number of environments, without `for_play`."""

    @classmethod
    def for_training(cls, num_envs):
        return cls()

    def choose(self, observations, legal, situation):
        return legal.argmax(axis=1)


def test_playing_does_not_change_the_training_meta_controller():
    trainer = Trainer(SMALL.changed(meta="test_run_reuse:Counting"))
    trainer.advance()
    meta = trainer.agents["meta_0"].meta
    before = meta.asked
    pair, turns = trainer.freeze(4, seed=0), trainer.fresh_turns(4, 0)
    for _ in range(30):
        pair.step(turns)
    assert meta.asked == before > 0
    assert pair.agents["meta_0"].meta.asked > before


def test_for_training_without_for_play_raises_input_error():
    with pytest.raises(InputError, match=r"needs for_play\(num_envs, \*, seed\)"):
        make_meta("test_run_reuse:ForSixtyFour", 64)


@pytest.fixture
def run(tmp_path):
    config = SMALL.changed(meta="test_run_reuse:Counting")
    trainer = Trainer(config)
    trainer.advance()
    folder = RunFolder.create(tmp_path / "run", config)
    folder.save_checkpoint(trainer.state_dict())
    return folder


def test_load_with_other_meta_ignores_the_runs_meta(run, monkeypatch):
    config = (run.path / "config.json").read_text()
    (run.path / "config.json").write_text(config.replace("test_run_reuse:Counting", "nowhere.to.be:Found"))
    agent = load(run.path, meta="fixed-dfs")
    assert agent.pair(4).step(agent.turns(4)).actions.shape == (4,)
    with pytest.raises(InputError, match=r"meta is 'nowhere.to.be:Found' and was 'test_run_reuse:Count"):
        load(run.path, trust=True)


def test_agent_env_changes_only_entries_of_the_environment(run):
    agent = load(run.path, trust=True)
    turns = agent.turns(2, env=agent.env(graph="c", size=13, goal_mask="existing"))
    assert turns.world.state.size == 13
    assert (turns.world.state.levels["n_rooms"] == 3).all()
    for name, value in {
        "gamma": 0.5,
        "method": "ppo",
        "features": ("view",),
        "drop_key": True,
        "reward": "bonus",
    }.items():
        with pytest.raises(InputError, match=f"a trained agent cannot be played with another {name}"):
            agent.env(**{name: value})
    with pytest.raises(InputError, match=r"^environments have no entry grpah; is it graph\?$"):
        agent.env(grpah="g")


def test_run_resumes_without_its_goal_graph_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    own = GoalGraph((0, 1, 1), 3)
    own.to_toml("mine.toml")
    flags = ["--size", "11", "--max-steps", "60", "--num-envs", "8", "--minibatches", "2", "--out", "run"]
    flags += ["--evaluation-episodes", "8", "--film", "False"]
    assert train(["--graph", "a", "mine.toml", "rooms:3", "--exclude", "c", *flags, "--steps", "512"]) == 0
    (tmp_path / "mine.toml").write_text("something else")
    (tmp_path / "else").mkdir()
    monkeypatch.chdir(tmp_path / "else")
    assert train(["--resume", "../run", "--steps", "1024"]) == 0
    folder = RunFolder.open("../run")
    assert run_name(folder.config()).startswith("hippo-fixed-dfs-a-mine-rooms-3-no-c-seed0-size11-")
    assert "on graph a, mine, rooms:3 without c, seed 0" in folder.config().title
    names = ["a", "keys-0-1-exit-1", "b", "mine"]
    agent = load(folder.path)

    def played(**entries):
        return [graph.name for graph in agent.turns(2, env=agent.env(**entries)).world.sampler.everything]

    assert played() == names
    assert played(graph=["c", own]) == ["c", "keys-0-1-1-exit-3"]
    assert played(exclude="a") == ["keys-0-1-exit-1", "b", "mine"], "c, which training left out, stays out"


def test_an_interrupt_at_any_moment_is_saved(tmp_path, monkeypatch, capsys):
    """An update reads once whether an interrupt was requested, so the last update is always saved."""
    from hierroom.runs import session

    for moment in range(1, 8):
        asked = []

        class Interrupt:
            def __init__(self, **_):
                pass

            def __enter__(self):
                return self

            def __exit__(self, *_):
                pass

            @property
            def is_requested(self):
                asked.append(1)  # noqa: B023 - used within the loop's turn alone
                return len(asked) >= moment  # noqa: B023

        monkeypatch.setattr(session, "Interrupt", Interrupt)
        trainer, folder = session.begin(SMALL.changed(steps=10**6), tmp_path / str(moment))
        assert session.run_session(trainer, folder) == 130
        assert folder.load_checkpoint()["steps"] == trainer.steps >= folder.metrics.numbers()[-1]["steps"]
        np.testing.assert_array_less(0, trainer.steps)
