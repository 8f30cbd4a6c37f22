"""Decisions of a run of a user's task, made once from a trial of its environment."""

import math
from dataclasses import replace

import chest_task
import pytest

from hierroom.runs import decisions
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.decisions import decide, episodes_now, speed_in_words
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.train import main as train

SMALL = ["--task", "chest_task:chest", "--num-envs", "4", "--sequence-length", "8", "--minibatches", "2"]
SMALL += ["--epochs", "1", "--hidden-size", "8", "--evaluations", "0", "--threads", "1", "--log", "none"]


@pytest.mark.parametrize(
    ("entries", "film", "said"),
    [
        ({"steps": 100_000}, False, "may take 21 seconds; --film True writes one"),
        ({"steps": 100_000, "film": True}, True, ""),
        ({"steps": 1_000_000}, True, ""),  # at most 100 seconds
        ({"steps": 100_000, "max_steps": 100}, True, ""),  # 2.1 seconds
    ],
)
def test_film_of_a_task_depends_on_the_speed_of_its_trial(entries, film, said, capsys):
    task = replace(chest_task.chest, max_steps=1000)
    task.__dict__["trial"] = replace(chest_task.chest.trial, step_seconds=0.001)
    assert decide(TrainConfig().changed(task=task, evaluations=0, **entries)).film is film
    printed = capsys.readouterr().err
    assert said in printed
    assert printed.count("\n") == bool(said)


def test_shipped_worlds_and_measured_times_decide_nothing_else():
    for config in (TrainConfig(), TrainConfig().changed(task="workshop:4")):
        assert decide(config) is config
    config = TrainConfig().changed(task="chest_task:chest", max_steps=3)
    assert decide(config) == config.changed(film=True)


def test_run_keeps_its_decision_when_it_is_resumed(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with monkeypatch.context() as slow:
        slow.setattr(decisions, "MOST_SECONDS", 0.0)
        slow.setattr(decisions, "MOST_SHARE", 0.0)
        assert train([*SMALL, "--steps", "64"]) == 0
    (run,) = (tmp_path / "runs").iterdir()
    assert "film" not in run.name
    assert "one episode     none, as film is False" in capsys.readouterr().out
    assert train(["--resume", str(run), "--steps", "128", "--trust-run", "--log", "none"]) == 0
    config = RunFolder.open(run).config()
    assert config.film is False
    assert not config.differences(config.changed(film=None))  # so that a sweep goes on with it
    assert not list(run.glob("*.gif"))


@pytest.mark.parametrize(
    ("entries", "step_seconds", "steps"),
    [
        ({}, 0.1, 7_535),  # 7 / 93 of 100,000, and a little, as nothing is learned
        ({}, 1e-5, 24_086),  # learning takes longer than the environment
        ({"steps": 10**8}, 0.1, None),  # 17 evaluations of 100 episodes of 1,000 steps are less
        ({"evaluation_episodes": 100}, 0.1, None),
        ({"evaluations": 4}, 0.1, None),
    ],
)
def test_evaluations_of_a_slow_task_have_a_tenth_of_the_time(entries, step_seconds, steps, capsys):
    task = replace(chest_task.chest, max_steps=1000)
    task.__dict__["trial"] = replace(chest_task.chest.trial, step_seconds=step_seconds)
    config = decide(TrainConfig().changed(**{"task": task, "steps": 100_000, "film": False, **entries}))
    assert config.evaluation_steps == steps
    said = f"evaluations take at most {steps:,} steps" if steps else ""
    assert said in capsys.readouterr().err
    words = speed_in_words(config, 0)
    assert words.startswith(f"; its environments take {1 / step_seconds:,.0f} steps/s, so training about ")


def test_steps_of_evaluations_become_later_and_fewer_episodes():
    config = TrainConfig().changed(evaluation_steps=1700, max_steps=500)
    assert episodes_now(config.changed(evaluation_steps=None), 0, 17, 10.0) is None
    assert [episodes_now(config, 0, 17, length) for length in (math.nan, 500.0, 10.0, 1.0)] == [0, 0, 10, None]
    assert [episodes_now(config, used, 1, 900.0) for used in (0, 1700, 5000)] == [1, 1, 1], "one at the end"


def test_run_of_a_slow_task_evaluates_less_and_resumes_so(tmp_path, monkeypatch, capsys):
    slow = replace(chest_task.chest.trial, step_seconds=0.5)
    monkeypatch.setitem(chest_task.chest.__dict__, "trial", slow)
    small = [word for word in SMALL if word not in ("--evaluations", "0")]
    out = str(tmp_path / "run")
    assert train([*small, "--steps", "1024", "--film", "False", "--out", out]) == 0
    said = capsys.readouterr()
    assert "2 steps/s, so training about 9 minutes" in said.out
    assert "evaluations take at most 77 steps" in said.err
    rows = RunFolder.open(tmp_path / "run").evaluations.read()
    assert float(rows[-1]["steps"]) == 1024
    assert sum(float(row["episodes"]) * float(row["length"]) for row in rows) < 0.15 * 1024
    assert train(["--resume", out, "--steps", "1056", "--trust-run", "--log", "none"]) == 0
    assert RunFolder.open(tmp_path / "run").config().evaluation_steps == 77
