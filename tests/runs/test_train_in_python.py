"""Training and loading from Python alone."""

import signal
import threading
from pathlib import Path

import pytest
from stopped_run import stop_at_update

import hierroom
from hierroom.support.errors import InputError

SMALL = {"graph": "b", "size": 11, "max_steps": 100, "num_envs": 8, "minibatches": 2, "steps": 512}
SMALL |= {"evaluations": 2, "evaluation_episodes": 8}


def test_train_from_python_returns_the_agent(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    agent = hierroom.train(**SMALL)
    (folder,) = (tmp_path / "runs").iterdir()
    assert folder == Path.cwd() / agent.path
    assert (folder / "escape.gif").exists() != (folder / "failure.gif").exists()
    assert agent.steps == 512
    assert len(list(hierroom.rollout(agent, None, 3))) == 3
    config = hierroom.find_preset("paper").changed(**SMALL)
    other = hierroom.train(config, out="other", graph="a", steps=256)
    assert (other.config.env.graph, other.config.agents.features) == ("a", ("view-ids", "goal"))
    assert hierroom.load("other").steps == other.steps
    with pytest.raises(InputError, match="the config of a training run has no gprah"):
        hierroom.train(gprah="a")
    with pytest.raises(InputError, match="is not an empty folder"):
        hierroom.train(config, out="other")


def test_interrupted_train_saves_and_raises_keyboard_interrupt(tmp_path, monkeypatch, capsys):
    stop_at_update(monkeypatch, signal.SIGINT, 1)
    with pytest.raises(KeyboardInterrupt):
        hierroom.train(out=tmp_path / "run", **SMALL | {"steps": 100_000})
    assert "stopped and saved" in capsys.readouterr().out
    assert 0 < hierroom.load(tmp_path / "run").steps < 100_000


def test_second_ctrl_c_says_how_to_go_on(tmp_path, monkeypatch, capsys):
    stop_at_update(monkeypatch, signal.SIGINT, 1)
    stop_at_update(monkeypatch, signal.SIGINT, 1)
    with pytest.raises(KeyboardInterrupt):
        hierroom.train(out=tmp_path / "run", **SMALL | {"steps": 100_000})
    said = "stopped; the checkpoint after 0 steps is kept; go on with:\npython -m hierroom train --resume "
    assert said in capsys.readouterr().out
    assert hierroom.load(tmp_path / "run").steps == 0


def test_train_works_outside_the_main_thread(tmp_path):
    trained = []
    thread = threading.Thread(target=lambda: trained.append(hierroom.train(out=tmp_path / "run", **SMALL)))
    thread.start()
    thread.join()
    assert trained[0].steps == 512
