"""The folder of a run: whole files, honest errors, nothing executed."""

import errno
import json
from pathlib import Path

import numpy as np
import pytest
import torch

from hierroom.env_config import EnvConfig
from hierroom.errors import InputError
from hierroom.files import to_json
from hierroom.goals import GoalGraph, as_goal_graph
from hierroom.training.config import TrainConfig
from hierroom.training.run_folder import CHECKPOINT_FORMAT, RunFolder

SMALL = TrainConfig(EnvConfig("a", size=11))


def test_dropping_metrics_keeps_the_rows_before_as_they_were(tmp_path):
    folder = RunFolder.create(tmp_path / "run", SMALL)
    folder.metrics.drop_after(0)
    for steps in (10, 20):
        folder.metrics.append([{"steps": steps, "success_rate": 0.1 + 0.2, "episode_length": float("nan")}])
    metrics = folder.path / "metrics.csv"
    first = metrics.read_bytes().splitlines(keepends=True)[:2]
    folder.metrics.drop_after(10)
    assert metrics.read_bytes() == b"".join(first)


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
        folder.save_checkpoint({"steps": steps})
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

    monkeypatch.setattr("hierroom.files.os.replace", full)
    for write in (lambda: folder.save_summary({"steps": 2}), lambda: folder.save_checkpoint({"steps": 2})):
        with pytest.raises(InputError, match="No space left on device"):
            write()
    assert json.loads((folder.path / "summary.json").read_text()) == {"steps": 1}
    assert not list(folder.path.rglob("*.part"))
    assert not list(folder.checkpoints.iterdir())


def test_nothing_in_a_checkpoint_is_executed(tmp_path):
    class Evil:
        def __reduce__(self):
            return (Path.touch, (tmp_path / "evil",))

    folder = RunFolder.create(tmp_path / "run", SMALL)
    torch.save({"format": CHECKPOINT_FORMAT, "evil": Evil()}, folder.checkpoints / "000000000001.pt")
    with pytest.raises(InputError, match="cannot read the checkpoint"):
        folder.load_checkpoint()
    assert not (tmp_path / "evil").exists()


def test_a_checkpoint_in_another_format_is_refused(tmp_path):
    folder = RunFolder.create(tmp_path / "run", SMALL)
    folder.save_checkpoint({"format": 99, "steps": 1})
    with pytest.raises(InputError, match=rf"has format 99, this hierroom reads {CHECKPOINT_FORMAT}$"):
        folder.load_checkpoint()
    torch.save([1, 2], folder.checkpoints / "000000000002.pt")
    with pytest.raises(InputError, match=rf"has format None, this hierroom reads {CHECKPOINT_FORMAT}$"):
        folder.load_checkpoint()


def test_a_checkpoint_holds_numbers_of_numpy_as_plain_ones(tmp_path):
    folder = RunFolder.create(tmp_path / "run", SMALL)
    state = {
        "steps": 1,
        "mine": {"rate": np.float64(0.5), "n": [np.int32(3)], "counts": np.arange(3.0), 4: (True, None)},
    }
    folder.save_checkpoint(state)
    mine = folder.load_checkpoint()["mine"]
    assert (mine["rate"], mine["n"], mine[4]) == (0.5, [3], (True, None))
    assert type(mine["rate"]) is float
    assert torch.equal(mine["counts"], torch.arange(3.0).double())


@pytest.mark.parametrize("wrong", [object(), {1, 2}, np.array(["a"]), {"deep": [object()]}, {None: 1}])
def test_a_checkpoint_refuses_what_could_not_be_read_again(wrong, tmp_path):
    folder = RunFolder.create(tmp_path / "run", SMALL)
    with pytest.raises(InputError, match=r"a checkpoint cannot hold mine[\w.\[\]]*, which is ") as caught:
        folder.save_checkpoint({"steps": 1, "mine": wrong})
    assert "\n" not in str(caught.value)
    assert not list(folder.checkpoints.iterdir())
