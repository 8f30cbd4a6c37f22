"""One process at a time trains a run, also after one was killed; runs begun together get separate folders."""

import multiprocessing
import os
import signal
import subprocess
import sys
from multiprocessing.synchronize import Barrier
from pathlib import Path

import pytest
from children import TIMES_QUIET

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder, claim_folder
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


N_PROCESSES, N_ROUNDS = 8, 6


def claim(number: int, barrier: Barrier, folder: Path) -> None:
    """In each round claim a folder by the same name, and try to create the one given as `--out`."""
    for n in range(N_ROUNDS):
        barrier.wait()
        run = RunFolder.create(claim_folder(folder / "runs" / f"name{n}"), SMALL.changed(seed=number))
        assert run.config().env == SMALL.env
        for kind in ("new", "empty"):
            barrier.wait()
            try:
                RunFolder.create(folder / kind / str(n), SMALL.changed(seed=number))
                outcome = "won"
            except InputError as error:
                outcome = str(error)
            (folder / "outcomes" / f"{kind}-{n}-{number}").write_text(outcome)


@pytest.mark.slow
def test_eight_processes_never_claim_the_same_folder(tmp_path):
    for n in range(N_ROUNDS):
        (tmp_path / "empty" / str(n)).mkdir(parents=True)
    (tmp_path / "outcomes").mkdir()
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["hierroom.runs.folder.run_folder"])  # torch is imported once, not eight times
    barrier = context.Barrier(N_PROCESSES, timeout=TIMES_QUIET * 6)
    processes = [context.Process(target=claim, args=(n, barrier, tmp_path)) for n in range(N_PROCESSES)]
    for process in processes:
        process.start()
    for process in processes:
        process.join(timeout=TIMES_QUIET * 12)
    assert [process.exitcode for process in processes] == [0] * N_PROCESSES
    for n in range(N_ROUNDS):
        names = [f"name{n}", *(f"name{n}-{k}" for k in range(2, N_PROCESSES + 1))]
        assert sorted(path.name for path in tmp_path.glob(f"runs/name{n}*")) == names
        seeds = {RunFolder.open(tmp_path / "runs" / name).config().seed for name in names}
        assert seeds == set(range(N_PROCESSES))
        for kind in ("new", "empty"):
            outcomes = [(tmp_path / "outcomes" / f"{kind}-{n}-{k}").read_text() for k in range(N_PROCESSES)]
            assert outcomes.count("won") == 1
            assert RunFolder.open(tmp_path / kind / str(n)).config().seed == outcomes.index("won")
            refused = f"{tmp_path / kind / str(n)} is not an empty folder; choose another --out, or --resume it"
            assert outcomes.count(refused) == N_PROCESSES - 1


def test_unclaimable_folder_raises_input_error(tmp_path):
    (tmp_path / "runs").write_text("a file")
    with pytest.raises(InputError, match=r"^cannot create the folder .*/runs: File exists$"):
        claim_folder(tmp_path / "runs" / "name")
    with pytest.raises(InputError, match=r"^cannot create the folder .*: File name too long$"):
        claim_folder(tmp_path / ("long" * 100))


def test_claim_folder_keeps_existing_files(tmp_path):
    (tmp_path / "name").write_text("a file")
    (tmp_path / "name-2").symlink_to("nowhere")
    assert claim_folder(tmp_path / "name") == tmp_path / "name-3"
    assert (tmp_path / "name").read_text() == "a file"
