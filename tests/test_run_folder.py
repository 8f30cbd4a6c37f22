"""The folder of a run: whole files, honest errors, nothing executed."""

import errno
import json
from pathlib import Path

import numpy as np
import pytest

from hierroom.env_config import EnvConfig
from hierroom.errors import InputError
from hierroom.files import to_json
from hierroom.goals import GoalGraph, as_goal_graph
from hierroom.training.config import TrainConfig
from hierroom.training.csv_table import CSVTable
from hierroom.training.run_folder import RunFolder

SMALL = TrainConfig(EnvConfig("a", size=11))


def state_after(steps, **mine):
    """The outline of what a checkpoint holds, and in it what a meta-controller saves."""
    outline = {"turns": {}, "levels": {}, "agents": {"meta_0": mine, "controller_0": {}}, "log": {}}
    return {**outline, "steps": steps, "seconds": 0.0, "compile_seconds": 0.0}


def test_dropping_metrics_keeps_the_rows_before_as_they_were(tmp_path):
    folder = RunFolder.create(tmp_path / "run", SMALL)
    folder.metrics.drop_after(0)
    for steps in (10, 20):
        folder.metrics.append([{"steps": steps, "success_rate": 0.1 + 0.2, "episode_length": float("nan")}])
    metrics = folder.path / "metrics.csv"
    first = metrics.read_bytes().splitlines(keepends=True)[:2]
    folder.metrics.drop_after(10)
    assert metrics.read_bytes() == b"".join(first)
    metrics.write_bytes(b"".join(first) + b"20,0\n")
    with pytest.raises(InputError, match="is broken"):
        folder.metrics.drop_after(10)


def test_a_run_keeps_its_goal_graph(tmp_path):
    own = tmp_path / "own.toml"
    GoalGraph((0, 1), 2).to_toml(own)
    config = SMALL.changed(graph=str(own))
    folder = RunFolder.create(tmp_path / "run", config)
    own.unlink()
    moved = RunFolder.open(folder.path.rename(tmp_path / "elsewhere"))
    assert as_goal_graph(moved.config().env.graph) == GoalGraph((0, 1), 2)
    assert moved.config().changed(graph="a") == SMALL
    table = json.loads((moved.path / "config.json").read_text())
    assert table["env"]["graph"] == [{"name": "own", "key_rooms": [0, 1], "exit_room": 2}]
    assert not list(moved.path.glob("*.toml"))


def test_a_file_that_is_called_as_a_named_graph_is_not_the_graph(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path(SMALL.env.graph).write_text("something else")
    assert RunFolder.create(tmp_path / "run", SMALL).config() == SMALL


def test_a_checkpoint_is_found_by_its_steps(tmp_path):
    folder = RunFolder.create(tmp_path / "run", SMALL)
    for steps in (64, 128):
        folder.save_checkpoint(state_after(steps))
    (folder.checkpoints / "mine.pt").write_bytes(b"of no concern")
    assert folder.load_checkpoint()["steps"] == 128
    assert folder.load_checkpoint(64)["steps"] == 64
    with pytest.raises(InputError, match="has checkpoints after 64, 128 steps, not 65"):
        folder.load_checkpoint(65)


def test_not_a_number_is_null_in_json():
    assert json.loads(to_json({"a": (float("nan"), 1.5), "b": {"c": None}})) == {"a": [None, 1.5], "b": {"c": None}}


def test_a_full_disk_is_one_line_and_the_old_file_stays(tmp_path, monkeypatch):
    folder = RunFolder.create(tmp_path / "run", SMALL)
    folder.save_summary({"steps": 1})
    folder.metrics.append([{"steps": 1, "episodes": 0}])

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("hierroom.files.os.fsync", full)
    for write in (lambda: folder.save_summary({"steps": 2}), lambda: folder.save_checkpoint({"steps": 2})):
        with pytest.raises(InputError, match="No space left on device"):
            write()
    assert json.loads((folder.path / "summary.json").read_text()) == {"steps": 1}
    assert not list(folder.path.rglob("*.part"))
    assert not list(folder.checkpoints.iterdir())


def test_metrics_keep_their_rows_when_the_disk_is_full(tmp_path):
    folder = RunFolder.create(tmp_path / "run", SMALL)
    path = folder.path / "metrics.csv"
    path.symlink_to("/dev/full")
    with pytest.raises(InputError, match="No space left on device"):
        folder.metrics.append([{"steps": 1, "episodes": 0}])
    path.unlink()
    folder.metrics.append([{"steps": 1, "episodes": 0}])
    assert folder.metrics.numbers() == [{"steps": 1.0, "episodes": 0.0}]


def test_a_row_that_a_crash_left_unfinished_is_dropped(tmp_path):
    table = CSVTable(tmp_path / "metrics.csv")
    table.append([{"steps": n, "loss": n / 2} for n in (1, 2, 3)])
    whole = table.path.read_bytes()
    for cut in range(1, 5):
        table.path.write_bytes(whole[:-cut])
        torn = CSVTable(table.path)
        assert [row["steps"] for row in torn.numbers()] == [1, 2]
        torn.append([{"steps": 3, "loss": 1.5}])
        assert table.path.read_bytes() == whole
    table.path.write_bytes(whole[:-2])
    CSVTable(table.path).drop_after(1)
    assert [row["steps"] for row in table.numbers()] == [1]


def test_the_columns_of_a_table_are_those_of_its_first_row(tmp_path):
    table = CSVTable(tmp_path / "metrics.csv")
    table.append([{"steps": 1, "loss": 0.5}])
    table.append([{"steps": 2}])
    assert np.isnan(table.numbers()[1]["loss"])
    for again in (table, CSVTable(table.path)):
        with pytest.raises(InputError, match="has the columns of its first row, and no gain"):
            again.append([{"steps": 3, "gain": 1}])
    assert len(table.numbers()) == 2
