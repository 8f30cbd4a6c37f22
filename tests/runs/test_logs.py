"""Loggers: what each receives, and what happens to one that fails.

Weights & Biases is a stand-in here, which takes what the real one takes and nothing else.
"""

import json
import math
import re
import signal
import sys
from types import ModuleType, SimpleNamespace

import pytest
from stopped_run import stop_at_update
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

import hierroom
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.logs.logs import Logs, logger_names
from hierroom.runs.logs.scalars import tag
from hierroom.support.errors import InputError
from hierroom.train import main

TINY = {"graph": "a", "size": 11, "max_steps": 60, "num_envs": 16, "minibatches": 2, "steps": 1024, "film": False}
OPTIONS = "--graph a --size 11 --max-steps 60 --num-envs 16 --minibatches 2 --evaluation-episodes 5".split()  # noqa: SIM905


class Wandb(ModuleType):
    """A stand-in with the parts of ``wandb`` that are used."""

    def __init__(self):
        super().__init__("wandb")
        self.__file__ = "stand-in"
        self.began, self.rows, self.summary, self.axes, self.ends, self.fails = [], [], {}, {}, [], False
        self.Settings = lambda *, console: {"console": console}

    def init(self, *, project, name, id, resume, config, dir, settings):
        self.began.append(SimpleNamespace(**locals()))
        return SimpleNamespace(
            id=id or "abc123", define_metric=self._define, log=self._log, summary=self.summary, finish=self._finish
        )

    def _define(self, name, *, step_metric=None):
        self.axes[name] = step_metric

    def _log(self, row):
        if self.fails:
            raise ConnectionError("no\nnetwork")
        self.rows.append(row)

    def _finish(self, *, exit_code):
        self.ends.append(exit_code)


@pytest.fixture
def wandb(monkeypatch):
    stand_in = Wandb()
    monkeypatch.setitem(sys.modules, "wandb", stand_in)
    monkeypatch.delenv("WANDB_PROJECT", raising=False)
    return stand_in


def expected_of(folder):
    """Return the finite values that a logger should get from a run's tables, by (tag, steps)."""
    output = {}
    for row in RunFolder(folder).metrics.numbers():
        output |= {(tag(name), int(row["steps"])): value for name, value in row.items() if name != "steps"}
    for row in RunFolder(folder).evaluations.read():
        for name in ("success_rate", "length", "return", "length_over_shortest"):
            output[f"eval/{name}", int(row["steps"])] = float(row[name])
    return {key: value for key, value in output.items() if math.isfinite(value)}


def test_all_loggers_receive_the_same_values(wandb, tmp_path):
    hierroom.train(**TINY, evaluations=3, evaluation_episodes=5, out=tmp_path / "run", log="tensorboard,wandb")
    expected = expected_of(tmp_path / "run")
    assert len(expected) > 20
    shown = {(name, row["steps"]): value for row in wandb.rows for name, value in row.items() if name != "steps"}
    for key, value in expected.items():
        assert shown[key] == pytest.approx(value, abs=1e-6)
    assert all(math.isfinite(value) for value in shown.values())
    events = EventAccumulator(str(tmp_path / "run")).Reload()
    for (name, steps), value in shown.items():
        assert {one.step: one.value for one in events.Scalars(name)}[steps] == pytest.approx(value, rel=1e-5, abs=1e-6)
    assert "_hparams_/session_start_info" in events.summary_metadata


def test_wandb_logger_reports_the_run(wandb, tmp_path, monkeypatch):
    monkeypatch.setenv("WANDB_PROJECT", "own project")
    hierroom.train(**TINY, evaluations=2, evaluation_episodes=5, out=tmp_path / "run", log="wandb")
    (began,) = wandb.began
    assert (began.project, began.name, began.dir, began.id) == ("own project", "run", str(tmp_path / "run"), None)
    assert (began.config["steps"], began.config["graph"], began.config["num_envs"]) == (1024, "a", 16)
    assert began.settings == {"console": "off"}
    assert wandb.axes == {"steps": None, "*": "steps"}
    assert wandb.summary["steps"] == 1024
    assert 0 <= wandb.summary["eval/success_rate"] <= 1
    assert wandb.ends == [0]
    assert json.loads((tmp_path / "run" / "logs.json").read_text()) == {"wandb": "abc123"}
    assert not list((tmp_path / "run").glob("events*"))  # TensorBoard was not named


@pytest.mark.slow
def test_resumed_run_continues_its_wandb_log(wandb, tmp_path, capsys):
    out = tmp_path / "run"
    assert main([*OPTIONS, "--steps", "1024", "--out", str(out), "--log", "wandb"]) == 0
    assert main(["--resume", str(out), "--steps", "2048", "--log", "wandb"]) == 0
    assert [began.id for began in wandb.began] == [None, "abc123"]
    n = len(wandb.rows)
    assert main(["--resume", str(out), "--steps", "3072"]) == 0  # the run does not keep --log
    assert len(wandb.rows) == n
    assert list(out.glob("events*"))


def test_interrupted_run_prints_its_resume_command(wandb, tmp_path, monkeypatch, capsys):
    stop_at_update(monkeypatch, signal.SIGINT, 1)
    assert main([*OPTIONS, "--steps", "4096", "--out", str(tmp_path / "run"), "--log", "wandb"]) == 130
    assert wandb.ends == [130]
    assert f"--resume {tmp_path / 'run'} --log wandb\n" in capsys.readouterr().out


def test_failing_logger_warns_once_and_training_continues(wandb, tmp_path, capsys):
    wandb.fails = True
    hierroom.train(**TINY, evaluations=2, evaluation_episodes=5, out=tmp_path / "run", log="wandb,tensorboard")
    warned = [line for line in capsys.readouterr().err.splitlines() if "warning" in line]
    (line,) = warned
    assert line.startswith("warning: ConnectionError: no network (line ")
    assert line.endswith("test_logs.py); training goes on without Weights & Biases")
    assert expected_of(tmp_path / "run")
    assert list((tmp_path / "run").glob("events*"))


def test_logger_failing_at_start_warns(wandb, tmp_path, monkeypatch, capsys):
    def refuse(**options):
        raise PermissionError("no key")

    monkeypatch.setattr(wandb, "init", refuse)
    hierroom.train(**TINY, evaluations=0, out=tmp_path / "run", log="wandb")
    output = capsys.readouterr().err
    said = r"warning: PermissionError: no key \(.*test_logs.py\); training goes on without Weights & Biases\n"
    assert re.search(said, output)


@pytest.mark.parametrize("content", ["{", "[1]", '{"wandb": 3}', '"wandb"', "\\xff"])
def test_unreadable_logs_json_starts_a_new_log(wandb, tmp_path, content):
    (tmp_path / "logs.json").write_text(content)
    Logs(tmp_path, TrainConfig(), -1, ("wandb",))
    assert wandb.began[0].id is None


def test_missing_logger_package_raises_input_error(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "wandb", None)
    with pytest.raises(InputError) as caught:
        main([*OPTIONS, "--out", str(tmp_path / "run"), "--log", "tensorboard,wandb"])
    assert str(caught.value) == "--log wandb needs the package wandb, which `pip install wandb` installs"
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    "given", ["", "tensorbord", "mlflow", "none,wandb", "wandb,,tensorboard", None, ["tensorboard"], 3]
)
def test_unknown_loggers_are_refused(wandb, given):
    said = "--log takes tensorboard, wandb" if isinstance(given, str) else "log is a text of names"
    with pytest.raises(InputError, match=f"^{said}.* joined by commas, or '?none'?, not "):
        logger_names(given)


def test_logger_names_are_split_and_deduplicated(wandb):
    assert logger_names("wandb, tensorboard,wandb") == ("wandb", "tensorboard")
    assert logger_names("none") == ()
