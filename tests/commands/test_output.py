"""Training and commands with output that is closed, unread, full or limited to ASCII."""

import errno
import io
import os
import signal
import sys
import threading
import time
from pathlib import Path
from unittest.mock import Mock

import pytest
from children import run_child, run_python

from hierroom.commands import report
from hierroom.support import cli
from hierroom.support.errors import InputError
from hierroom.support.interrupt import Interrupt
from hierroom.support.kernel import LINE
from hierroom.support.output import LastingStream, lasting_output, warn

TRAIN = f"{sys.executable} -m hierroom train --graph a --size 11 --max-steps 60 --num-envs 8 --minibatches 2"
TRAIN += " --sequence-length 16 --steps 512 --evaluations 1 --evaluation-episodes 8 --threads 1 --out run"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "code"),
    [
        (f"set -o pipefail; {TRAIN} | head -1", 0),
        (f"{TRAIN} >&- 2>&- <&-", 0),
        (f"PYTHONIOENCODING=ascii {TRAIN} > /dev/full", 0),
        (f"{TRAIN} --graph z 2>&-", 2),
    ],
)
def test_train_survives_lost_output(command, code, tmp_path):
    done = run_child(["bash", "-c", command], cwd=tmp_path, text=False)
    assert done.returncode == code, done.stderr
    assert done.stderr.removeprefix(f"{LINE}\n".encode()) == b""  # the first test after a change compiles kernels
    assert (tmp_path / "run" / "summary.json").exists() == (code == 0)
    assert len(list((tmp_path / "run").glob("*.gif"))) == (code == 0)


@pytest.mark.slow
def test_closed_terminal_saves_the_run(tmp_path):
    """Its commands get SIGHUP, sometimes twice, and can print no more."""
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
def test_failing_stream_raises_nothing(error, monkeypatch):
    broken = Broken()
    broken.error = error
    monkeypatch.setattr(sys, "stdout", broken)
    monkeypatch.setattr(sys, "stderr", broken)
    with lasting_output():
        print("one", flush=True)
        print("two", file=sys.stderr)
    assert sys.stdout is broken
    warn("three")


def test_lasting_stream_escapes_characters_outside_its_encoding():
    stream = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    lasting = LastingStream(stream)
    print("a ━ b", file=lasting, flush=True)
    assert stream.buffer.getvalue() == b"a \\u2501 b\n"
    assert lasting.encoding == "ascii"
    assert LastingStream(None).write("lost") == 4


@pytest.mark.usefixtures("heeded_hangup")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP", "SIGUSR1", "SIGUSR2", "SIGXCPU"])
def test_only_a_second_ctrl_c_raises_keyboard_interrupt(name):
    number = signal.Signals[name]
    before = signal.getsignal(number)
    with Interrupt() as interrupt:
        os.kill(os.getpid(), number)
        assert interrupt.is_requested
        if number == signal.SIGINT:
            with pytest.raises(KeyboardInterrupt):
                os.kill(os.getpid(), number)
        else:
            os.kill(os.getpid(), number)
            os.kill(os.getpid(), signal.SIGINT)  # the first Ctrl-C
    assert signal.getsignal(number) is before


@pytest.mark.parametrize("name", ["SIGUSR1", "SIGXCPU"])
def test_interrupt_keeps_signal_handlers_of_the_caller(name):
    number, heard = signal.Signals[name], []
    before = signal.signal(number, lambda *_: heard.append(name))
    try:
        with Interrupt() as interrupt:
            os.kill(os.getpid(), number)
            assert (interrupt.is_requested, heard) == (False, [name])
    finally:
        signal.signal(number, before)


def test_ctrl_c_after_the_end_is_silent(tmp_path):
    code = """
import atexit, os, signal
from hierroom.support.cli import run
atexit.register(lambda: os.kill(os.getpid(), signal.SIGINT))
run(lambda: 0)
"""
    done = run_python("-c", code, cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")


def test_gymnasiums_warnings_are_printed_without_colours(tmp_path):
    code = """
from gymnasium import logger
from hierroom.support.cli import run
run(lambda: logger.warn("the range is odd") or 0)
"""
    assert run_python("-c", code, cwd=tmp_path).stderr == "warning: WARN: the range is odd\n"


def test_shell_words_are_read_back_by_bash():
    words = ["-a", "a b", "it's", "$HOME", "*", "", "new\nline", "\x1b[31m", "back\\\tslash", "Grün\t", "\udcff.toml"]
    line = cli.shell_words(*words, Path("-dash"), Path("a b/-c"))
    assert line.isprintable()
    done = run_child(["bash", "-c", f"printf '%s\\0' {line}"], text=False)
    assert [os.fsdecode(word) for word in done.stdout.split(b"\0")[:-1]] == [*words, "./-dash", "a b/-c"]


def test_hangup_ignored_by_nohup_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Interrupt() as interrupt:
            os.kill(os.getpid(), signal.SIGHUP)
            assert not interrupt.is_requested
    finally:
        signal.signal(signal.SIGHUP, before)


def test_unwritable_output_exits_with_an_error(tmp_path):
    command = f"{sys.executable} -m hierroom > /dev/full"
    done = run_child(["bash", "-c", command], cwd=tmp_path)
    assert done.stderr == "error: cannot write the output: No space left on device\n"
    assert done.returncode == 2


@pytest.mark.parametrize(
    ("error", "shown"),
    [
        (OSError(errno.EMFILE, "Too many open files"), "Too many open files"),
        (OSError(errno.ENOSPC, "No space left on device"), "cannot write the output: No space left on device"),
        (OSError("the socket is closed"), "the socket is closed"),
        (OSError(errno.EACCES, "Permission denied", "a.csv"), "Permission denied: 'a.csv'"),
    ],
)
def test_system_error_is_shown_with_its_file(error, shown, capsys):
    def command() -> int:
        raise error

    with pytest.raises(SystemExit) as ended:
        cli.run(command)
    assert ended.value.code == 2
    assert capsys.readouterr().err == f"error: {shown}\n"


@pytest.mark.slow
def test_full_standard_error_keeps_the_exit_code(tmp_path):
    command = f"{sys.executable} -m hierroom"
    for words, code in (("trian", 2), ("complexity --graph c b keys-0-1-exit-2 --csv", 0)):
        done = run_child(["bash", "-c", f"{command} {words} 2> /dev/full"], cwd=tmp_path)
        assert done.returncode == code
        assert (len(done.stdout.splitlines()) == 3) == (code == 0)


def test_new_report_keeps_one_that_is_written_meanwhile(tmp_path, monkeypatch, capsys):
    def page(arguments):
        Path("report.html").write_bytes(b"another's")
        return b"ours", []

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(report, "_page", page)
    assert report.main(["runs"]) == 0
    assert Path("report.html").read_bytes() == b"another's"
    assert Path("report-2.html").read_bytes() == b"ours"
    assert capsys.readouterr().out.startswith("report-2.html (")
    monkeypatch.setattr(report, "write_atomically", Mock(side_effect=InputError("the disk is full")))
    with pytest.raises(InputError, match="the disk is full"):
        report.main(["runs"])
    assert not Path("report-3.html").exists()


def test_broken_pipe_in_rich_exits_with_code_0(capsys):
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
