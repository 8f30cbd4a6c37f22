"""A prepared run folder is refused if resuming it would change files outside it."""

import os
from pathlib import Path

import pytest

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.folder.run_lock import RunLock
from hierroom.support.errors import InputError
from hierroom.worlds.env_config import EnvConfig

FILES = ("metrics.csv", "evaluations.csv", "episodes.csv", "config.json", "provenance.json", "logs.json")
FILES += ("summary.json", "learning_curve.png", "escape.gif", "failure.gif", "checkpoints/000000000064.pt", ".lock")
FOLDERS = ("checkpoints", "modules", "modules/lab", "modules/session-2")


@pytest.fixture
def run(tmp_path) -> RunFolder:
    folder = RunFolder.create(tmp_path / "run", TrainConfig(EnvConfig("a", size=11)))
    for name in FILES:
        (folder.path / name).write_text("ours")
    for name in (f".{'0a' * 8}.part", "checkpoints/000000000032-interrupted.pt"):  # what `tidy` deletes
        (folder.path / name).write_text("")
    (folder.path / "modules" / "lab").mkdir(parents=True)
    (tmp_path / "other").mkdir()
    for name in ("mine", "000000000096-interrupted.pt", f".{'0b' * 8}.part"):
        (tmp_path / "other" / name).write_text("precious")
    return folder


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def check_refused(run: RunFolder, said: str) -> None:
    before = contents(run.path.parent)
    with pytest.raises(InputError, match=said), run.lock:
        run.tidy()
    assert contents(run.path.parent) == before


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("target", ["../other/mine", "nowhere", "/dev/zero"])
def test_link_in_place_of_file_is_refused_without_changes(name, target, run):
    path = run.path / name
    path.unlink()
    path.symlink_to(os.path.relpath(run.path / target, path.parent) if target[0] == "." else target)
    check_refused(run, f"cannot write .*{path.name}: it is a link, which is not followed")


@pytest.mark.parametrize("name", FOLDERS)
def test_link_in_place_of_folder_is_refused_without_changes(name, run):
    path = run.path / name
    if path.exists():
        path.rename(run.path.parent / "away")
    path.symlink_to(run.path.parent / "other")
    check_refused(run, f"cannot write .*{path.name}: it is a link, which is not followed")


@pytest.mark.parametrize("target", ["nowhere", "../config.json", None])
def test_file_in_place_of_session_folder_is_refused(target, run):
    path = run.path / "modules" / "session-2"
    path.symlink_to(target) if target else path.write_text("")
    check_refused(run, f"cannot write .*session-2: {'it is a link' if target else 'it is no folder'}")


@pytest.mark.parametrize("name", ["metrics.csv", "evaluations.csv", "episodes.csv", RunLock.FILE])
def test_hard_link_in_place_of_file_is_refused(name, run):
    (run.path / name).unlink()
    os.link(run.path.parent / "other" / "mine", run.path / name)
    check_refused(run, f"cannot write .*{name}: it is another file too")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
@pytest.mark.parametrize("name", FILES)
def test_pipe_in_place_of_file_is_refused(name, run):
    (run.path / name).unlink()
    os.mkfifo(run.path / name)
    check_refused(run, f"cannot write .*{name}: it is no regular file")


def test_tidy_keeps_files_of_others(run):
    other = run.path.parent / "other"
    (run.path / "checkpoints" / "best.pt").symlink_to(other / "mine")
    (run.path / f".{'0c' * 8}.part").symlink_to(other / "mine")
    (run.path / "wandb").symlink_to(other)
    before = contents(other)
    with run.lock:
        run.tidy()
    assert contents(other) == before
    assert (run.path / f".{'0c' * 8}.part").is_symlink()
    assert not (run.path / f".{'0a' * 8}.part").exists()
    assert not (run.path / "checkpoints" / "000000000032-interrupted.pt").exists()
