"""Pictures of users' environments: any kind becomes RGB or is refused in one line, and no run is lost for one."""

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import chest_task
import numpy as np
import pictures
import pytest
import torch
from children import run_python
from PIL import Image

import hierroom
from hierroom.agents.playback import save_episodes
from hierroom.commands import report, watch
from hierroom.support.errors import InputError
from hierroom.train import main as train
from hierroom.worlds.task.local_envs import LONGEST_SIDE, as_picture

TESTS = Path(__file__).parents[1]
SMALL = ["--num-envs", "4", "--sequence-length", "8", "--minibatches", "2", "--epochs", "1", "--hidden-size", "8"]
SMALL += ["--steps", "64", "--evaluations", "0", "--threads", "1", "--log", "none"]
GREY = np.array([[0, 51], [102, 255]])
SHOWN = np.repeat(GREY[..., None], 3, axis=2)


@pytest.mark.parametrize(
    ("drawn", "shown"),
    [
        (SHOWN.astype(np.uint8), SHOWN),
        (SHOWN, SHOWN),  # int64
        (SHOWN.tolist(), SHOWN),
        (GREY, SHOWN),
        (GREY[..., None].astype(np.int16), SHOWN),
        (GREY.astype(np.uint16), SHOWN),
        ((GREY * 257).astype(">u2"), SHOWN),
        (GREY.astype(np.float64), SHOWN),
        ((GREY / 255).astype(np.float32), SHOWN),
        (GREY / 255 + [[-0.01, 0.0], [0.0, 0.01]], SHOWN),  # as interpolation leaves it
        (SHOWN > 100, np.where(SHOWN > 100, 255, 0)),
        (np.dstack([SHOWN, [[0, 9], [9, 9]]]), SHOWN),
        (torch.tensor(GREY / 255), SHOWN),
        (Image.fromarray(GREY.astype(np.uint8)).convert("P"), SHOWN),
        (Image.fromarray((GREY * 257).astype(np.uint16)), SHOWN),
        (np.zeros((2 * LONGEST_SIDE, 4), bool), np.zeros((LONGEST_SIDE, 2, 3))),
    ],
)
def test_picture_becomes_rgb(drawn, shown):
    picture = as_picture(drawn)
    assert picture.dtype == np.uint8
    np.testing.assert_array_equal(picture, shown)
    assert not (isinstance(drawn, np.ndarray) and np.shares_memory(picture, drawn))


@pytest.mark.parametrize(
    ("drawn", "given"),
    [
        (None, "not None"),
        ("a text", "not 'a text'"),
        ([SHOWN, SHOWN], r"not int64 of shape \[2, 2, 2, 3\]"),
        ([SHOWN, SHOWN[:1]], "not a list"),
        (SHOWN.transpose(2, 0, 1), r"not int64 of shape \[3, 2, 2\]"),
        (np.zeros((0, 5, 3)), r"not one of shape \[0, 5, 3\]"),
        (SHOWN - 1, "not -1 to 254"),
        (SHOWN + 1, "not 1 to 256"),
        (np.full((2, 2), np.nan), "not nan to nan"),
    ],
)
def test_no_picture_is_refused_in_one_line(drawn, given):
    with pytest.raises(InputError, match=f"^render must return .*, {given}$"):
        as_picture(drawn)


@pytest.fixture(autouse=True)
def _can_draw_again():
    yield
    chest_task.chest.replayer.no_picture = ""


def growing(env):
    return np.zeros((60 + 60 * env.cell, 90, 3), np.uint8)


def failing_later(env):
    return np.zeros((9, 9)) if env.cell in (0, 2) else 1 / 0  # where it starts


@pytest.fixture(autouse=True)
def own_task(monkeypatch):
    """A task asks once whether its environment can be drawn, so each test has its own."""
    monkeypatch.setattr(chest_task, "chest", replace(chest_task.chest))


@pytest.mark.parametrize(
    ("render", "why"),
    [
        (lambda env: np.full((9, 9), 0.5), ""),
        (growing, ""),
        (failing_later, "the environment cannot be drawn: ZeroDivisionError"),
        (lambda env: "a text", "render must return a picture"),
    ],
)
def test_run_ends_well_whatever_its_environment_draws(render, why, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(chest_task.Chest, "render", render)
    monkeypatch.chdir(tmp_path)
    assert train(["--task", "chest_task:chest", *SMALL, "--out", "run"]) == 0
    said = capsys.readouterr()
    assert (f"warning: there is no film of an episode: {why}" in said.err) == bool(why)
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["steps"] == 64
    assert report.main(["run", "--trust-run", "--episodes", "1", "--played", "4"]) == 0
    page, said = (tmp_path / "report.html").read_text(), capsys.readouterr().out
    assert ("data:image/gif" in page) == (not why)
    assert (f"- run has no film: {why}" in said) == bool(why)
    assert re.search(r"<figcaption>run: task chest_task:chest, seed 0.* Subgoals: ", page)
    assert watch.main(["run", "--trust-run", "--out", "one.txt"]) == 0
    if why:
        with pytest.raises(InputError, match=why):
            watch.main(["run", "--trust-run", "--out", "one.gif"])
    else:
        (film,) = (tmp_path / "run").glob("*.gif")
        assert len({frame.shape for frame in pictures.frames(film)}) == 1


def test_environment_that_cannot_draw_is_asked_once(tmp_path, monkeypatch):
    """MuJoCo aborts the process if it draws without a display a second time."""
    asked = []
    monkeypatch.setattr(chest_task.Chest, "render", lambda env: asked.append(env))
    for episode in list(hierroom.rollout("random", hierroom.EnvConfig(task=chest_task.chest), 3, num_envs=3)):
        with pytest.raises(InputError, match="render must return a picture"):
            save_episodes([episode], tmp_path / "a.gif")
    assert len(asked) == 1


@pytest.mark.parametrize("task", [chest_task.chest, chest_task.split], ids=["same process", "other processes"])
def test_render_of_an_api_shows_any_picture_and_says_why_not(task, monkeypatch):
    drawn = {"picture": np.full((60, 40), 0.2)}
    monkeypatch.setattr(chest_task.Chest, "render", lambda env: drawn["picture"] if env.cell >= 0 else None)
    env = hierroom.env(task, render_mode="rgb_array")
    env.reset(seed=0)
    picture = env.render()
    assert picture.dtype == np.uint8
    np.testing.assert_array_equal(picture[:60, :40], np.full((60, 40, 3), 51))
    while env.observe("controller_0")["place"] >= 0:
        env.step(0)
    with pytest.raises(InputError, match="render must return a picture"):
        env.render()
    env.close()


def test_drawing_where_no_screen_is_prints_nothing():
    draw = "env = hierroom.env(chest_task.pole, render_mode='rgb_array'); env.reset(seed=0); assert env.render().any()"
    here = {**os.environ, "PYTHONPATH": os.pathsep.join([str(TESTS.parent), str(TESTS)])}
    screens = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER", "XDG_RUNTIME_DIR")
    env = {name: value for name, value in here.items() if name not in screens}
    done = run_python("-c", f"import os, chest_task, hierroom; {draw}; print('SDL_VIDEODRIVER' in os.environ)", env=env)
    assert (done.returncode, done.stdout, done.stderr) == (0, "False\n", "")
