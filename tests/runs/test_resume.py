"""A stopped, killed or hindered run resumes exactly: every file equals that of an uninterrupted run."""

import errno
import os
import shutil
import signal
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from children import run_child
from same_run import differences, scalars
from stopped_run import stop_at_update

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.provenance import FILE
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.session import begin, resume
from hierroom.support.errors import InputError
from hierroom.train import main as train

FLAGS = ["--size", "11", "--max-steps", "60", "--num-envs", "8", "--sequence-length", "16", "--minibatches", "2"]
FLAGS += ["--epochs", "1", "--hidden-size", "8", "--evaluations", "3", "--evaluation-episodes", "8"]
FLAGS += ["--threads", "1", "--steps", "2048"]
LEARNED = ["--meta", "learned", "--meta-start-success", "0", "--meta-ppo.sequence-length", "2"]
LEARNED += ["--meta-ppo.sequences-per-update", "4", "--meta-ppo.minibatches", "2"]  # it learns a few times a run
RUNS = {
    "fixed": ["--graph", "a", "b"],
    "learned": ["--graph", "a", *LEARNED],
    "curriculum": ["--graph", "rooms:3", "--curriculum-stages", "2"],
}
KILLS = Path(__file__).parents[1] / "fuzz" / "kills.py"


Whole = tuple[list[str], Path]


def trained(name: str, factory: pytest.TempPathFactory) -> Whole:
    """The options of a run, and its folder."""
    options, out = [*RUNS[name], *FLAGS], factory.mktemp(name) / "run"
    assert train([*options, "--out", str(out)]) == 0
    return options, out


@pytest.fixture(scope="module")
def whole_of(tmp_path_factory) -> Callable[[str], Whole]:
    return cache(lambda name: trained(name, tmp_path_factory))


@pytest.fixture(scope="module", params=RUNS)
def whole(request, whole_of) -> Whole:
    return whole_of(request.param)


@pytest.fixture
def fixed(whole_of) -> Whole:
    return whole_of("fixed")


@pytest.mark.usefixtures("heeded_hangup")
@pytest.mark.parametrize(
    ("number", "at"), [(signal.SIGINT, 1), pytest.param(signal.SIGHUP, 6, marks=pytest.mark.slow), (signal.SIGTERM, 15)]
)
def test_stopped_run_resumes_to_equal_files(number, at, whole, tmp_path, monkeypatch):
    options, folder = whole
    stop_at_update(monkeypatch, number, at)
    out = str(tmp_path / "run")
    assert train([*options, "--out", out]) == 130
    assert train(["--resume", out]) == 0
    assert differences(folder, Path(out)) == []
    assert train(["--resume", out]) == 0  # a finished run writes its results again
    assert differences(folder, Path(out)) == []


@pytest.mark.parametrize("checkpoint", [0, pytest.param(4, marks=pytest.mark.slow), 10])
def test_run_resumes_from_any_checkpoint(checkpoint, whole, tmp_path):
    _, folder = whole
    shutil.copytree(folder, out := tmp_path / "run")
    for path in sorted((out / "checkpoints").iterdir())[checkpoint + 1 :]:
        path.unlink()
    for table in RunFolder(out).tables:
        with table.path.open("ab") as file:
            file.write(b"9999,0.5,\0\0\0")
    assert train(["--resume", str(out)]) == 0
    assert differences(folder, out) == []


def test_differences_finds_every_change(fixed, tmp_path):
    _, folder = fixed
    shutil.copytree(folder, out := tmp_path / "run")
    (out / "more").write_text("")
    text = (out / "metrics.csv").read_text()
    (out / "metrics.csv").write_text(text[: len(text) // 2].rpartition("\n")[0] + "\n")
    changed = RunFolder.open(out)
    changed.save_checkpoint({**changed.load_checkpoint(512), "steps": 1024})
    shutil.copy(next(out.glob("events*")), out / "events.out.tfevents.9999999999.again.1.0")
    found = differences(folder, out)
    wanted = [
        "more is in other",
        "checkpoints/000000001024.pt differs",
        "metrics.csv differs",
        "the events differ",
    ]
    assert [line[: len(said)] for line, said in zip(found, wanted, strict=True)] == wanted


def full(*_, **__):
    raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.slow
@pytest.mark.parametrize("at", range(5))
def test_full_disk_at_the_start_leaves_a_usable_folder(at, tmp_path, monkeypatch):
    """config.json, modules, provenance.json and checkpoint are put in their places, one after the other."""
    out, replace, calls = tmp_path / "run", os.replace, []

    def nearly_full(*arguments):
        calls.append(1)
        (full if len(calls) > at else replace)(*arguments)

    options = [*RUNS["fixed"], *FLAGS[:-1], "128", "--out", str(out)]
    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", nearly_full)
        with pytest.raises(InputError, match="No space left on device"):
            train(options)
    is_run = (out / "config.json").exists()
    assert is_run == (at > 0)
    if is_run and at < 4:
        with pytest.raises(InputError, match="choose another --out, or --resume it"):
            train(options)
        if at < 3:  # there is no checkpoint yet, and a copy by git has no empty folder
            (out / "checkpoints").rmdir()
    assert train(["--resume", str(out)] if is_run else options) == 0
    assert RunFolder.open(out).load_checkpoint()["steps"] == 128
    assert not list(out.rglob("*.part"))


def test_resume_without_checkpoints_raises_input_error(fixed, tmp_path):
    shutil.copytree(fixed[1], out := tmp_path / "run")
    shutil.rmtree(out / "checkpoints")
    before = (out / "metrics.csv").read_bytes()
    with pytest.raises(InputError, match="has no checkpoint in checkpoints/"):
        train(["--resume", str(out)])
    assert (out / "metrics.csv").read_bytes() == before


def test_out_refuses_a_folder_with_other_files(tmp_path):
    for name in ("mine.txt", FILE, "metrics.csv", "checkpoints/000000000000.pt", "mine.part"):
        path = tmp_path / name.replace("/", "-") / name
        path.parent.mkdir(parents=True)
        path.write_text("")
        with pytest.raises(InputError, match="is not an empty folder"):
            train([*FLAGS, "--out", str(tmp_path / name.replace("/", "-"))])
        assert [one for one in path.parents[name.count("/")].rglob("*") if one.is_file()] == [path]


def test_resume_warns_of_lost_rows(fixed, tmp_path, capsys):
    shutil.copytree(fixed[1], out := tmp_path / "run")
    lines = (out / "metrics.csv").read_bytes().splitlines(keepends=True)
    (out / "metrics.csv").write_bytes(b"".join([*lines[:3], *lines[4:]]))
    (out / "episodes.csv").unlink()
    assert train(["--resume", str(out)]) == 0
    output = capsys.readouterr().err
    n_rows = len(lines) - 1
    assert f"warning: {out}/metrics.csv has lost 1 of {n_rows} rows; the run goes on without them\n" in output
    assert f"warning: {out}/episodes.csv has lost " in output
    assert (out / "metrics.csv").read_bytes() == b"".join([*lines[:3], *lines[4:]])


def test_resume_warns_of_a_learning_rate_jump(tmp_path, capsys):
    config = TrainConfig().changed(steps=64, num_envs=4, sequence_length=16, evaluations=0, size=11, hidden_size=8)
    trainer, folder = begin(config.changed(final_learning_rate_fraction=0.1), tmp_path / "run")
    trainer.advance()
    folder.save_checkpoint(trainer.state_dict())
    folder.lock.release()
    for steps, said in ((64, ""), (128, "controller_0 goes on at 5.5e-04 after 1.0e-04: it falls over 128 steps")):
        resumed, again = resume(folder.config().changed(steps=steps), folder.path)
        again.lock.release()
        output = capsys.readouterr().err
        assert said in output
        assert bool(said) == ("learning rate" in output)
    resumed.advance()
    assert resumed.metrics()["learning_rate"] == pytest.approx(1e-4)


def test_resume_refuses_a_damaged_table_without_changes(fixed, tmp_path):
    shutil.copytree(fixed[1], out := tmp_path / "run")
    lines = (out / "metrics.csv").read_bytes().splitlines(keepends=True)
    (out / "metrics.csv").write_bytes(broken := b"".join([*lines[:3], b"1,2\r\n", *lines[4:]]))
    with pytest.raises(InputError, match=r"line 4 has not as many .*; mend it, or delete the table to go on without"):
        train(["--resume", str(out)])
    assert (out / "metrics.csv").read_bytes() == broken
    (out / "metrics.csv").unlink()
    assert train(["--resume", str(out)]) == 0


def test_unwritable_events_warn_once(fixed, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("hierroom.runs.logs.logs.append_whole", lambda *_: (_ for _ in ()).throw(InputError("full")))
    options, folder = fixed
    assert train([*options, "--out", str(tmp_path / "run")]) == 0
    assert capsys.readouterr().err == "warning: full; training goes on without TensorBoard\n"
    assert [line.split(" differ")[0] for line in differences(folder, tmp_path / "run")] == ["the events"]
    assert len(scalars(folder)) > 10


@pytest.mark.slow
def test_killed_runs_lose_nothing():
    command = [sys.executable, str(KILLS), "--kills", "6", "--runs", "learned", "--seed", "3"]
    done = run_child(command)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("6 kills, 3 of them at a file operation and 3 at a random moment")
