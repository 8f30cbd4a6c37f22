"""Checks of the folder of a finished run: each file, and that the files agree with each other."""

import json
from itertools import pairwise
from math import isfinite, isnan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from pictures import frames, pixels
from scipy.stats import binomtest

from hierroom.agents.playback import MOST_IN_GIF, film
from hierroom.runs import results
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.logs.episode_log import WINDOW
from hierroom.runs.logs.learning_curve import MILESTONES, LearningCurve, evaluation_points
from hierroom.runs.trained_agent import load
from hierroom.turns.records import CONTROLLER

Rows = list[dict[str, float]]


def check_run(path: Path) -> dict[str, Any]:
    """Assert all that is true of every run with as few steps as in tests; returns its summary."""
    folder = RunFolder.open(path)
    config, rows = folder.config(), folder.metrics.numbers()
    check_metrics(rows, config)
    summary = json.loads((path / "summary.json").read_text())
    curve = check_evaluations(folder, config)
    check_episodes(folder, rows)
    check_summary(summary, rows, curve)
    assert pixels(path / "learning_curve.png").shape == (384, 960, 3)
    return summary


def check_metrics(rows: Rows, config: TrainConfig) -> None:
    assert len(rows) > 1
    assert rows[-2]["steps"] < config.steps <= rows[-1]["steps"]  # it ended with the first update that had enough steps
    for before, row in pairwise(rows):
        assert before["steps"] < row["steps"]
        assert before["seconds"] < row["seconds"]
        assert before["episodes"] <= row["episodes"]
    for row in rows:
        each = row["steps"] / config.num_envs
        assert each.is_integer()
        assert each // config.env.max_steps * config.num_envs <= row["episodes"] <= row["steps"]
        assert 0 <= row["success_rate"] <= 1
        window = min(row["episodes"], WINDOW)
        assert abs(row["success_rate"] * window - round(row["success_rate"] * window)) < 1e-9  # a number of episodes
        length = row["episode_length"]
        assert 1 <= length <= config.env.max_steps if row["episodes"] else isnan(length)
        for name in ("policy_loss", "value_loss", "entropy", "gradient_norm"):
            assert isfinite(row[name]), name
        assert row["gradient_norm"] > 0
        assert row["entropy"] > 0


def check_evaluations(folder: RunFolder, config: TrainConfig) -> LearningCurve:
    """Each point has an evaluation at the first update at or after it, with a row for each graph and its interval."""
    rows, taken = folder.evaluations.read(), [row["steps"] for row in folder.metrics.numbers()]
    points = evaluation_points(config.steps, config.evaluations)
    update = int(min(np.diff([0, *taken])))
    assert [int(row["steps"]) for row in rows] == sorted({-(-point // update) * update for point in points})
    for row in rows:
        rate, n = float(row["success_rate"]), int(row["episodes"])
        assert n == config.evaluation_episodes or (config.evaluation_episodes is None and n in range(25, 101, 25))
        assert rate * n == pytest.approx(round(rate * n), abs=1e-3)
        interval = binomtest(round(rate * n), n).proportion_ci(method="wilson")
        in_row = float(row["success_low"]), float(row["success_high"])
        assert in_row == pytest.approx((interval.low, interval.high), abs=1e-6)
        assert 1 <= float(row["length"]) <= config.env.max_steps
    return LearningCurve.of_rows(rows)


def check_episodes(folder: RunFolder, rows: Rows) -> None:
    """Every episode that metrics.csv counts is there, and its window's means are those of the last of them."""
    episodes = folder.episodes.read()
    assert len(episodes) == rows[-1]["episodes"]
    for row in rows:
        until = [one for one in episodes if int(one["steps"]) <= row["steps"]]
        assert len(until) == row["episodes"]
        window = until[-WINDOW:]
        for name, mean in (("success", "success_rate"), ("length", "episode_length"), ("return", "episode_return")):
            if window:
                assert np.mean([float(one[name]) for one in window]) == pytest.approx(row[mean])
    for one in episodes:
        assert (json.loads(one["goals"])[-1:] == ["exit"]) == bool(int(one["success"]))


def check_summary(summary: dict[str, Any], rows: Rows, curve: LearningCurve) -> None:
    last = rows[-1]
    for name in ("steps", "episodes", "seconds", "compile_seconds"):
        assert summary[name] == last[name], name
    assert summary["training_success_rate"] == last["success_rate"]
    assert summary["training_episode_length"] == (last["episode_length"] if last["episodes"] else None)
    assert summary["steps_per_second"] == pytest.approx(summary["steps"] / summary["seconds"])
    assert summary["rollout_bytes"] > 0
    assert summary["evaluated_success_rate"] == curve.success[-1]
    crossed = [milestone for milestone in MILESTONES if summary[f"steps_to_{milestone}"] is not None]
    assert crossed == [milestone for milestone in MILESTONES if (curve.success >= milestone / 100).any()]
    for name in ("steps", "seconds"):
        values = [summary[f"{name}_to_{milestone}"] for milestone in MILESTONES]
        assert [value is not None for value in values] == [milestone in crossed for milestone in MILESTONES]
        assert sorted(values[: len(crossed)]) == values[: len(crossed)]
        assert all(0 <= value <= last[name] + 1e-3 for value in values[: len(crossed)])


def weights(state: dict[str, Any]) -> dict[str, torch.Tensor]:
    """The controller's weights in a checkpoint."""
    return state["agents"][CONTROLLER]["learner"]["backend"]["network"]


def check_picture(path: Path) -> bool:
    """Assert that escape.gif or failure.gif shows the newest checkpoint's episode; returns whether it escapes."""
    torch.set_num_threads(1)  # as in training
    agent = load(path, trust=True)
    episode = results.telling_episode(agent, agent.config.seed + 1)
    name, other = ("escape", "failure") if episode.success else ("failure", "escape")
    assert not (path / f"{other}.gif").exists()
    shown, expected = frames(path / f"{name}.gif"), list(film([episode], most=MOST_IN_GIF))
    assert len(shown) == len(expected)
    for one, drawn in [*zip(shown, expected, strict=True)][::-7]:  # the last is among them
        assert one.shape == drawn.shape
        assert (abs(one - drawn).max(axis=2) > 10).sum() < 20  # pixels; there are 256 colours
    assert len({one.tobytes() for one in shown}) > 10
    return episode.success
