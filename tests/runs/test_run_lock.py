"""One process at a time trains a run, also after an earlier one was killed or failed."""

import os
import signal
import subprocess
import sys

import pytest

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.folder.run_lock import RunLock
from hierroom.runs.trained_agent import load
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.train import main as train
from hierroom.worlds.env_config import EnvConfig

SMALL = TrainConfig(EnvConfig("a", size=11, max_steps=60), num_envs=8, steps=512)
SMALL = SMALL.changed(minibatches=2, evaluations=0, film=False)
HOLD = "import sys; from pathlib import Path; from hierroom.runs.folder.run_lock import RunLock; "
HOLD += "lock = RunLock(Path(sys.argv[1])); lock.acquire(); print('held', flush=True); sys.stdin.read()"


@pytest.fixture
def run(tmp_path) -> RunFolder:
    folder = RunFolder.create(tmp_path / "run", SMALL)
    folder.save_checkpoint(Trainer(SMALL).state_dict())
    return folder


def test_locked_run_can_be_read_but_not_trained(run):
    command = [sys.executable, "-c", HOLD, str(run.path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline() == "held\n"
        before = {path: path.read_bytes() for path in run.path.rglob("*") if path.is_file()}
        with pytest.raises(InputError, match=r"run is being trained by another process; wait until that ends, or stop"):
            train(["--resume", str(run.path)])
        with pytest.raises(InputError, match="is not an empty folder; choose another --out, or --resume it"):
            RunFolder.create(run.path, SMALL)
        assert {path: path.read_bytes() for path in run.path.rglob("*") if path.is_file()} == before
        assert load(run.path).steps == 0
        holder.send_signal(signal.SIGKILL)
    assert (run.path / RunLock.FILE).exists()  # and yet it is no stale lock
    assert train(["--resume", str(run.path)]) == 0


def test_ended_or_failed_session_releases_the_lock(run, monkeypatch):
    def broken(self):
        raise InputError("as good as a full disk")

    kept = []
    for _ in range(2):
        with monkeypatch.context() as patch:
            patch.setattr(Trainer, "advance", broken)
            with pytest.raises(InputError, match="full disk") as caught:
                train(["--resume", str(run.path)])
        kept.append(caught)  # its frames keep the folder in memory
    assert train(["--resume", str(run.path)]) == 0
    assert train(["--resume", str(run.path)]) == 0
    with pytest.raises(InputError, match="--steps must be more") as caught:
        train(["--resume", str(run.path), "--steps", "1"])
    RunLock(run.path).acquire()


def test_a_lock_is_held_until_it_is_released(tmp_path):
    one, other = RunLock(tmp_path), RunLock(tmp_path)
    with one:
        one.acquire()  # a second call changes nothing
        with pytest.raises(InputError, match="by another process"):
            other.acquire()
    with other, pytest.raises(InputError, match="by another process"):
        one.acquire()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_lock_in_read_only_folder_raises_input_error(run):
    run.path.chmod(0o500)
    with pytest.raises(InputError, match=r"cannot lock the folder .*: Permission denied"):
        RunLock(run.path.parent / "run").acquire()
