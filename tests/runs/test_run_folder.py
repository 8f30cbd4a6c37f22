"""The folder of a run: whole files, honest errors, nothing executed."""

import re

import pytest

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder import checkpoint
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.support.errors import CheckpointError, InputError
from hierroom.worlds.env_config import EnvConfig

SMALL = TrainConfig(EnvConfig("a", size=11))


def state_after(steps, **mine):
    """A minimal state of a checkpoint, with these entries as the meta-controller's."""
    outline = {"config": "{}", "turns": {}, "agents": {"meta_0": mine, "controller_0": {}}, "log": {}}
    tables = dict.fromkeys(checkpoint.TABLES, 0)
    return {**outline, "tables": tables, "steps": steps, "seconds": 0.0, "compile_seconds": 0.0}


def test_renamed_checkpoint_raises_checkpoint_error(tmp_path):
    folder = RunFolder.create(tmp_path / "run", SMALL)
    for steps in (64, 128):
        path = folder.save_checkpoint(state_after(steps))
    path.with_name("000000000064.pt").rename(path.with_name("000000000256.pt"))
    said = r"256\.pt is one after 64 steps, and has been renamed; without it the run goes on from 000000000128\.pt$"
    with pytest.raises(CheckpointError, match=said):
        folder.load_checkpoint()


def test_broken_newest_checkpoint_error_names_the_one_before(tmp_path):
    folder = RunFolder.create(tmp_path / "run", SMALL)
    paths = []
    for steps in (64, 128, 256):
        folder.save_checkpoint(state_after(steps))
        paths = sorted(folder.checkpoints.iterdir())
    for path in paths:
        path.write_bytes(b"")
    with pytest.raises(InputError, match=f"; without it the run goes on from {re.escape(paths[1].name)}$"):
        folder.load_checkpoint()
    with pytest.raises(InputError, match=r"which this hierroom reads$"):
        folder.load_checkpoint(128)
    for path in paths[1:]:
        path.unlink()
    with pytest.raises(InputError, match=r"which this hierroom reads$"):
        folder.load_checkpoint()


def test_checkpoint_of_another_format_raises_checkpoint_error(tmp_path, monkeypatch):
    folder = RunFolder.create(tmp_path / "run", SMALL)
    with monkeypatch.context() as older:
        older.setattr(checkpoint, "CHECKPOINT_FORMAT", 3)
        for steps in (64, 128):
            folder.save_checkpoint(state_after(steps))
    said = f"has format 3, this hierroom reads {checkpoint.CHECKPOINT_FORMAT}$"
    with pytest.raises(CheckpointError, match=said):
        folder.load_checkpoint()


def test_broken_table_leaves_all_tables_unchanged(tmp_path):
    folder = RunFolder.create(tmp_path / "run", SMALL)
    rates = {"success_rate": 0.5, "length": 5, "episode_length": 5, "episodes": 1}
    unknown = dict.fromkeys(("seconds", "return", "length_over_shortest"), 1)
    for table in folder.tables:
        graph = {} if table is folder.metrics else {"graph": "a"}
        table.append([{"steps": steps, **rates, **unknown, **graph} for steps in (64, 128)])
    evaluations = folder.evaluations.path.read_text().replace("64,0.5", "64,abc")
    folder.evaluations.path.write_text(evaluations)
    before = [table.path.read_text() for table in folder.tables]
    with pytest.raises(InputError, match=r"evaluations\.csv is broken: line 2: success_rate .* 'abc'; mend it, or"):
        RunFolder(folder.path).keep_rows({"tables": dict.fromkeys(checkpoint.TABLES, 1), "steps": 64})
    assert [table.path.read_text() for table in folder.tables] == before
