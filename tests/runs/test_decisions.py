"""Decisions of a run of a user's task, made once from a trial of its environment."""

from dataclasses import replace

import chest_task
import pytest

from hierroom.runs import results
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.results import decide
from hierroom.support.errors import InputError
from hierroom.train import main as train

SMALL = ["--task", "chest_task:chest", "--num-envs", "4", "--sequence-length", "8", "--minibatches", "2"]
SMALL += ["--epochs", "1", "--hidden-size", "8", "--evaluations", "0", "--threads", "1", "--log", "none"]


def fail(task):
    raise InputError("the environment cannot be drawn")


@pytest.mark.parametrize(
    ("entries", "step_seconds", "picture_seconds", "film", "said"),
    [
        ({"steps": 100_000}, 0.001, lambda task: 0.01, False, "may take 23 seconds; --film True writes one"),
        ({"steps": 100_000, "film": True}, 0.001, lambda task: 0.01, True, ""),
        ({"steps": 1_000_000}, 0.001, lambda task: 0.01, True, ""),  # at most 100 seconds
        ({"steps": 100_000, "max_steps": 100}, 0.001, lambda task: 0.01, True, ""),  # 3.1 seconds
        ({"steps": 100_000, "max_steps": 100}, 0.001, lambda task: 0.09, False, "may take 11 seconds"),
        ({"steps": 1_000_000}, 0.001, fail, False, "there is no film of an episode: the environment cannot be drawn"),
    ],
)
def test_film_of_a_task_depends_on_the_speed_of_its_trial(
    entries, step_seconds, picture_seconds, film, said, monkeypatch, capsys
):
    task = replace(chest_task.chest, max_steps=1000)
    task.__dict__["trial"] = replace(chest_task.chest.trial, step_seconds=step_seconds)
    monkeypatch.setattr(results, "picture_seconds", picture_seconds)
    assert decide(TrainConfig().changed(task=task, **entries)).film is film
    printed = capsys.readouterr().err
    assert said in printed
    assert printed.count("\n") == bool(said)


def test_shipped_worlds_and_measured_times_decide_nothing_else():
    for config in (TrainConfig(), TrainConfig().changed(task="workshop:4")):
        assert decide(config) is config
    config = TrainConfig().changed(task="chest_task:chest")
    assert decide(config) == config.changed(film=True)


def test_run_keeps_its_decision_when_it_is_resumed(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with monkeypatch.context() as slow:
        slow.setattr(results, "MOST_SECONDS", 0.0)
        slow.setattr(results, "MOST_SHARE", 0.0)
        assert train([*SMALL, "--steps", "64"]) == 0
    (run,) = (tmp_path / "runs").iterdir()
    assert "film" not in run.name
    assert "one episode     none, as film is False" in capsys.readouterr().out
    assert train(["--resume", str(run), "--steps", "128", "--trust-run", "--log", "none"]) == 0
    config = RunFolder.open(run).config()
    assert config.film is False
    assert not config.differences(config.changed(film=None))  # so that a sweep goes on with it
    assert not list(run.glob("*.gif"))
