"""Sweeps that are killed, stopped or started twice leave the same table."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from children import TIMES_QUIET
from tiny_sweep import results, tiny_words


def start(out: Path) -> subprocess.Popen:
    words = tiny_words("steps=3000", "method=hippo,ppo")
    options = ["--seeds", "2", "--episodes", "4", "--processes", "2", "--out", str(out)]
    command = [sys.executable, "-m", "hierroom", "sweep", *words, *options]
    return subprocess.Popen(command, start_new_session=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def children(process: subprocess.Popen) -> list[int]:
    path = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    pids = [int(pid) for pid in path.read_text(encoding="utf-8").split()]
    return [pid for pid in pids if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]


def wait_for(condition, process: subprocess.Popen, seconds: float = TIMES_QUIET * 12) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end and process.poll() is None:
        if condition():
            return True
        time.sleep(0.05)
    return False


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory) -> list[dict[str, str]]:
    out = tmp_path_factory.mktemp("undisturbed")
    assert start(out).wait(TIMES_QUIET * 30) == 0
    return results(out / "sweep.csv")


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="children are looked up in /proc")
def test_killed_workers_and_a_killed_sweep_leave_the_same_table(tmp_path, undisturbed):
    process = start(tmp_path)
    assert wait_for(lambda: [*tmp_path.glob("runs/*/metrics.csv")], process)
    os.kill(children(process)[0], signal.SIGKILL)
    assert wait_for((tmp_path / "sweep.csv").exists, process)
    os.killpg(process.pid, signal.SIGKILL)  # the workers with it
    assert process.wait(TIMES_QUIET * 6) == -signal.SIGKILL
    assert start(tmp_path).wait(TIMES_QUIET * 30) == 0
    assert results(tmp_path / "sweep.csv") == undisturbed


@pytest.mark.slow
def test_two_sweeps_on_one_folder_share_the_runs(tmp_path, undisturbed):
    several = [start(tmp_path) for _ in range(2)]
    output = [process.communicate(timeout=TIMES_QUIET * 30)[0].decode() for process in several]
    assert [process.returncode for process in several] == [0, 0], output
    assert "failed" not in "".join(output)
    assert results(tmp_path / "sweep.csv") == undisturbed


@pytest.mark.slow
def test_stopped_sweep_prints_its_command_and_resumes(tmp_path, undisturbed):
    process = start(tmp_path)
    assert wait_for(lambda: [*tmp_path.glob("runs/*/metrics.csv")], process)
    process.send_signal(signal.SIGTERM)
    output = process.communicate(timeout=TIMES_QUIET * 12)[0].decode()
    assert process.returncode == 130
    assert "stopped and saved; go on with:\npython -m hierroom sweep" in output
    assert start(tmp_path).wait(TIMES_QUIET * 30) == 0
    assert results(tmp_path / "sweep.csv") == undisturbed


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="children are looked up in /proc")
def test_ctrl_c_stops_the_sweep_without_killing_workers(tmp_path, undisturbed):
    """A terminal sends Ctrl-C to all processes: the first one asks to stop, and each process saves its run."""
    process = start(tmp_path)
    # Once while they load their modules, and once while they train.
    for is_time in (lambda: len(children(process)) == 2, lambda: [*tmp_path.glob("runs/*/metrics.csv")]):
        assert wait_for(is_time, process)
        for pid in children(process):
            os.kill(pid, signal.SIGINT)
            os.kill(pid, signal.SIGINT)
    process.send_signal(signal.SIGINT)
    output = process.communicate(timeout=TIMES_QUIET * 12)[0].decode()
    assert process.returncode == 130
    assert "killed" not in output
    assert "Traceback" not in output
    assert start(tmp_path).wait(TIMES_QUIET * 30) == 0
    assert results(tmp_path / "sweep.csv") == undisturbed
