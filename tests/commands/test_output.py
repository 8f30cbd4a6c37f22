"""Training and commands whose output is closed, read no more, full or poor in characters."""

import errno
import io
import os
import signal
import sys
import threading
import time

import pytest
from children import run_child

from hierroom.runs.interrupt import Interrupt
from hierroom.runs.logs.output import LastingStream, lasting_output, warn
from hierroom.support import cli

TRAIN = f"{sys.executable} -m hierroom train --graph a --size 11 --max-steps 60 --num-envs 8 --minibatches 2"
TRAIN += " --sequence-length 16 --steps 512 --evaluations 1 --evaluation-episodes 8 --threads 1 --out run"


@pytest.mark.parametrize(
    ("command", "code"),
    [
        (f"set -o pipefail; {TRAIN} | head -1", 0),
        (f"{TRAIN} >&- 2>&- <&-", 0),
        (f"PYTHONIOENCODING=ascii {TRAIN} > /dev/full", 0),
        (f"{TRAIN} --graph z 2>&-", 2),
    ],
)
def test_training_ends_whoever_reads(command, code, tmp_path):
    done = run_child(["bash", "-c", command], cwd=tmp_path, text=False)
    assert done.returncode == code, done.stderr
    assert done.stderr == b""
    assert (tmp_path / "run" / "summary.json").exists() == (code == 0)
    assert len(list((tmp_path / "run").glob("*.gif"))) == (code == 0)


def test_a_terminal_that_is_closed_saves(tmp_path):
    """Its commands are sent SIGHUP, twice at times, and can print no more."""
    import pty

    process, terminal = pty.fork()
    if process == 0:
        os.chdir(tmp_path)
        signal.signal(signal.SIGHUP, signal.SIG_DFL)  # the tests may run under nohup, which training would heed
        os.execvp("bash", ["bash", "-c", f"exec {TRAIN} --steps 100000000"])
    reader = threading.Thread(target=lambda: os.read(terminal, 10**6))
    reader.start()
    try:
        deadline = time.monotonic() + 200
        while not (tmp_path / "run" / "metrics.csv").exists() and time.monotonic() < deadline:
            time.sleep(0.1)
        reader.join()
        os.close(terminal)
        os.kill(process, signal.SIGHUP)
        assert os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]) == 130
    except BaseException:
        os.kill(process, signal.SIGKILL)
        raise
    assert list((tmp_path / "run" / "checkpoints").glob("*-interrupted.pt"))


class Broken(io.StringIO):
    error: Exception

    def write(self, text: str) -> int:
        raise self.error

    def flush(self) -> None:
        raise self.error


@pytest.mark.parametrize("error", [OSError(errno.EIO, "gone"), BrokenPipeError(), ValueError("closed file")])
def test_nothing_is_raised_by_a_stream_that_fails(error, monkeypatch):
    broken = Broken()
    broken.error = error
    monkeypatch.setattr(sys, "stdout", broken)
    monkeypatch.setattr(sys, "stderr", broken)
    with lasting_output():
        print("one", flush=True)
        print("two", file=sys.stderr)
    assert sys.stdout is broken
    warn("three")


def test_characters_that_a_stream_lacks_are_written_as_escapes():
    stream = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    lasting = LastingStream(stream)
    print("a ━ b", file=lasting, flush=True)
    assert stream.buffer.getvalue() == b"a \\u2501 b\n"
    assert lasting.encoding == "ascii"
    assert LastingStream(None).write("lost") == 4


@pytest.mark.usefixtures("heeded_hangup")
@pytest.mark.parametrize(("number", "twice"), [(signal.SIGINT, True), (signal.SIGTERM, False), (signal.SIGHUP, False)])
def test_only_a_second_control_c_does_not_wait(number, twice):
    before = signal.getsignal(number)
    with Interrupt() as interrupt:
        os.kill(os.getpid(), number)
        assert interrupt.is_requested
        if twice:
            with pytest.raises(KeyboardInterrupt):
                os.kill(os.getpid(), number)
        else:
            os.kill(os.getpid(), number)
    assert signal.getsignal(number) is before


def test_what_nohup_ignores_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Interrupt() as interrupt:
            os.kill(os.getpid(), signal.SIGHUP)
            assert not interrupt.is_requested
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_command_whose_output_cannot_be_written_says_so(tmp_path):
    command = f"{sys.executable} -m hierroom > /dev/full"
    done = run_child(["bash", "-c", command], cwd=tmp_path)
    assert done.stderr == "error: cannot write the output: No space left on device\n"
    assert done.returncode == 2


def test_a_broken_pipe_that_rich_makes_an_exit_is_none(capsys):
    def command() -> int:
        try:
            raise BrokenPipeError
        except BrokenPipeError:
            raise SystemExit(1)  # noqa: B904 - as rich does

    with pytest.raises(SystemExit) as ended:
        cli.run(command)
    assert ended.value.code == 0
    with pytest.raises(SystemExit) as ended:
        cli.run(lambda: sys.exit(2))
    assert ended.value.code == 2
