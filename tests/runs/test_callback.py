"""The `callback` and `quiet` arguments of `hierroom.train`."""

import os
from typing import Any

import pytest
from same_run import differences

import hierroom
from hierroom.support.errors import InputError
from hierroom.train import main

SMALL = {"graph": "a", "size": 11, "max_steps": 60, "num_envs": 8, "sequence_length": 16, "minibatches": 2}
SMALL |= {"steps": 512, "film": False, "evaluations": 2, "evaluation_episodes": 4, "log": "none"}


def stop_at(steps, seen):
    def callback(trainer):
        seen.append((trainer.steps, trainer.evaluation, trainer.metrics()))
        return trainer.steps >= steps

    return callback


def test_run_stopped_by_callback_resumes_exactly(tmp_path, capsys):
    seen, whole = [], []
    agent = hierroom.train(**SMALL, out=tmp_path / "stopped" / "run", callback=stop_at(256, seen))
    assert "stopped by the callback and saved; go on with:" in capsys.readouterr().out
    assert (agent.steps, agent.is_finished, [steps for steps, *_ in seen]) == (256, False, [128, 256])
    assert seen[-1][1].episodes == 4
    assert {"success_rate", "episode_return", "policy_loss", "steps"} <= seen[-1][2].keys()
    assert not (tmp_path / "stopped" / "run" / "summary.json").exists()
    assert main(["--resume", str(tmp_path / "stopped" / "run"), "--log", "none"]) == 0
    agent = hierroom.train(**SMALL, out=tmp_path / "whole" / "run", callback=stop_at(512, whole))
    assert agent.is_finished, "a stop after the last update has no effect"
    assert len(whole) == 4
    assert differences(tmp_path / "stopped" / "run", tmp_path / "whole" / "run") == []


def test_callback_exception_is_raised_after_saving(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    class Pruned(Exception):
        pass

    def callback(trainer):
        os.chdir(tmp_path.parent)  # the path of the run is relative
        if trainer.steps > 128:
            raise Pruned

    with pytest.raises(Pruned):
        hierroom.train(**SMALL, out="run", callback=callback, quiet=True)
    agent = hierroom.load("run")
    assert (agent.steps, agent.is_finished) == (256, False)


def test_quiet_run_prints_only_its_callback_output(tmp_path, capfd, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")  # a bar as on a terminal
    entries = SMALL | {"features": ["view", "direction"], "method": "ppo", "subgoal_horizon": 9}
    agent = hierroom.train(**entries, out=tmp_path / "run", quiet=True, callback=lambda trainer: print("mine"))
    out, err = capfd.readouterr()
    assert (out, err) == ("mine\n" * 4, "")
    assert agent.is_finished
    hierroom.train(**entries, out=tmp_path / "loud")
    out, err = capfd.readouterr()
    assert "seconds of training" in out
    assert "warning: " in err


def test_invalid_callback_or_quiet_raises_input_error(tmp_path):
    cases: tuple[tuple[dict[str, Any], str], ...] = (
        ({"callback": 7}, "callback is a function of the trainer, not 7"),
        ({"quiet": "yes"}, "quiet must be True or False, not 'yes'"),
    )
    for named, message in cases:
        with pytest.raises(InputError, match=message):
            hierroom.train(**SMALL, out=tmp_path / "run", **named)
    assert not (tmp_path / "run").exists()
