"""What the folder of a finished run holds: each file by itself, and that they agree with each other."""

import json
from itertools import pairwise
from math import isfinite, isnan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from pictures import frames, pixels
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from hierroom.agents.playback import MOST_IN_GIF, film
from hierroom.options import CONTROLLER
from hierroom.training import session
from hierroom.training.config import TrainConfig
from hierroom.training.episode_log import MILESTONES, WINDOW
from hierroom.training.run_folder import RunFolder
from hierroom.training.trained_agent import load

Rows = list[dict[str, float]]


def check_run(path: Path) -> dict[str, Any]:
    """Assert what is true of every run that ended after as few steps as those of the tests; returns its summary."""
    folder = RunFolder.open(path)
    config, rows = folder.config(), folder.metrics.numbers()
    check_metrics(rows, config)
    summary = json.loads((path / "summary.json").read_text())
    check_summary(summary, rows)
    check_events(path, rows)
    check_checkpoints(folder, rows)
    check_learning_curve(path / "learning_curve.png", rows)
    return summary


def check_metrics(rows: Rows, config: TrainConfig) -> None:
    assert len(rows) > 1
    assert rows[-2]["steps"] < config.steps <= rows[-1]["steps"]  # it ended as soon as it might
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


def check_summary(summary: dict[str, Any], rows: Rows) -> None:
    last = rows[-1]
    for name in ("steps", "episodes", "success_rate", "seconds"):
        assert summary[name] == last[name], name
    assert summary["episode_length"] == (last["episode_length"] if last["episodes"] else None)
    assert summary["steps_per_second"] == pytest.approx(summary["steps"] / summary["seconds"])
    assert summary["rollout_bytes"] > 0
    crossed = [milestone for milestone in MILESTONES if summary[f"steps_to_{milestone}"] is not None]
    assert crossed == list(MILESTONES[: len(crossed)])  # a higher one implies those below
    for name in ("steps", "seconds"):
        values = [summary[f"{name}_to_{milestone}"] for milestone in MILESTONES]
        assert [value is not None for value in values] == [milestone in crossed for milestone in MILESTONES]
        assert sorted(values[: len(crossed)]) == values[: len(crossed)]
        assert all(0 < value <= last[name] for value in values[: len(crossed)])
    for milestone in MILESTONES:
        above = [r["steps"] for r in rows if r["episodes"] >= WINDOW and r["success_rate"] >= milestone / 100]
        if above:
            assert summary[f"steps_to_{milestone}"] <= above[0]
        if last["episodes"] < WINDOW:
            assert milestone not in crossed


def check_events(path: Path, rows: Rows) -> None:
    """TensorBoard shows every number of metrics.csv, in the single precision of its format."""
    events = EventAccumulator(str(path), size_guidance={"scalars": 0})
    events.Reload()
    assert set(events.Tags()["scalars"]) == set(rows[0])
    for name in rows[0]:
        scalars = events.Scalars(name)
        assert [scalar.step for scalar in scalars] == [row["steps"] for row in rows]
        np.testing.assert_array_equal(
            np.array([scalar.value for scalar in scalars], np.float32),
            np.array([row[name] for row in rows], np.float32),
        )


def weights(state: dict[str, Any]) -> dict[str, torch.Tensor]:
    """The controller's weights in a checkpoint."""
    return state["agents"][CONTROLLER]["learner"]["backend"]["network"]


def check_checkpoints(folder: RunFolder, rows: Rows) -> None:
    """They are named by their steps, agree with the metrics of these, and every weight has learned in between."""
    logged = {row["steps"]: row for row in rows}
    names = sorted(path.name for path in folder.checkpoints.iterdir())
    steps = [int(name.removesuffix(".pt")) for name in names]
    assert names == [f"{n:012d}.pt" for n in steps]
    assert steps[0] == 0
    assert steps[-1] == rows[-1]["steps"]
    states = [folder.load_checkpoint(n) for n in steps]
    assert [state["steps"] for state in states] == steps
    assert states[0]["log"]["episodes"] == 0
    for state in states[1:]:
        row, log = logged[state["steps"]], state["log"]
        assert (state["seconds"], log["episodes"]) == (row["seconds"], row["episodes"])
        assert len(log["successes"]) == len(log["lengths"]) == min(log["episodes"], WINDOW)
        if log["episodes"]:
            assert (np.mean(log["successes"]), np.mean(log["lengths"])) == (row["success_rate"], row["episode_length"])
    for before, state in pairwise(map(weights, states)):
        assert before.keys() == state.keys()
        for name, values in state.items():
            assert values.isfinite().all(), name
            assert values.shape == before[name].shape
            assert not torch.equal(values, before[name]), name


def check_learning_curve(path: Path, rows: Rows) -> None:
    """A green curve on the left and a blue one on the right, from the first row to the last, at their heights."""
    colours = pixels(path)
    assert colours.shape == (384, 960, 3)
    dark = colours.max(axis=2) < 80
    top, bottom = np.flatnonzero(dark.sum(axis=1) > 600)[[0, -1]]  # of both frames
    left, middle, after, right = np.flatnonzero(dark[top : bottom + 1].mean(axis=0) > 0.97)
    red, green, blue = np.moveaxis(colours, 2, 0)
    success, length = green - np.maximum(red, blue) > 25, blue - red > 40
    assert not success[:, middle:].any()
    assert not length[:, :after].any()
    known = [row["episode_length"] for row in rows if row["episodes"]]  # before, there is none
    ends = curve_ends(success[:, left:middle], top, bottom)
    assert ends == pytest.approx([row["success_rate"] / 1.01 for row in (rows[0], rows[-1])], abs=0.06)
    if len(known) > 1:
        first, last = curve_ends(length[:, after:right], top, bottom)
        assert last / first == pytest.approx(known[-1] / known[0], abs=0.06)


def curve_ends(curve: NDArray[np.bool_], top: int, bottom: int) -> list[float]:
    """Heights of the two ends of a curve that crosses its frame without a gap, 0 at the bottom and 1 at the top."""
    drawn = np.flatnonzero(curve.any(axis=0))
    assert drawn.tolist() == list(range(drawn[0], drawn[-1] + 1))
    assert len(drawn) > 0.85 * curve.shape[1]
    return [float((bottom - np.flatnonzero(curve[:, n]).mean()) / (bottom - top)) for n in (drawn[0], drawn[-1])]


def check_picture(path: Path) -> bool:
    """Assert that escape.gif, or else failure.gif, is what the newest checkpoint does; returns whether it escapes."""
    torch.set_num_threads(1)  # as in training
    agent = load(path)
    episode = session.telling_episode(agent, agent.config.seed + 1)
    name, other = ("escape", "failure") if episode.success else ("failure", "escape")
    assert not (path / f"{other}.gif").exists()
    shown, expected = frames(path / f"{name}.gif"), list(film([episode], most=MOST_IN_GIF))
    assert len(shown) == len(expected)
    for one, drawn in [*zip(shown, expected, strict=True)][::-7]:  # the last is among them
        assert one.shape == drawn.shape
        assert (abs(one - drawn).max(axis=2) > 10).sum() < 20  # pixels; there are 256 colours
    assert len({one.tobytes() for one in shown}) > 10
    return episode.success
