"""The commands, and how each ends: what went wrong is one line, and an input that cannot be used is exit code 2."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from hierroom.errors import InputError

COMMANDS: Mapping[str, str] = {
    "train": "train an agent and write a run folder",
    "watch": "watch a trained agent, its failures too: in a window, as GIF, MP4 or text",
    "evaluate": "success, length and steps to each goal of a trained agent",
    "compare": "learning curves of several runs, with intervals, as tables and a figure",
    "complexity": "how hard goal graphs are to explore, before anybody trains",
    "paper": "the paper's tables, ours beside its own numbers",
    "compile": "compile all kernels now, so that nothing waits for it later",
}
"""What people run, as ``python -m hierroom.NAME``, and what for."""


def program(name: str) -> str:
    """How a command was called, for its usage and for what completes it in a shell.

    Args:
        name: of the command, in `COMMANDS`.
    """
    script = f"hierroom-{name}"
    return script if Path(sys.argv[0]).stem == script else f"python -m hierroom.{name}"


def words(argv: Sequence[str] | None = None) -> list[str]:
    """The words of the command line, by default of this process.

    Raises:
        InputError: if an option of several graphs is given without any, or twice: the last would win, and both were
            meant.
    """
    given = [*(sys.argv[1:] if argv is None else argv)]
    for option in ("--graph", "--exclude"):
        if sum(word.partition("=")[0] == option for word in given) > 1:
            raise InputError(f"{option} is given twice; give it once, with all its graphs: {option} a b")
        after = given[given.index(option) + 1 :] if option in given else ["a graph"]
        if not after or after[0].startswith("--"):
            raise InputError(f"{option} is given without a graph; give at least one goal graph: {option} a b")
    return given


def run(command: Callable[[], int]) -> None:
    """Run a command and leave the process with its exit code, or with 2 where an input cannot be used.

    Output that is closed, that nobody reads any more or that lacks a character is no failure.
    """
    _open_streams()
    try:
        code = command()
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        code = 2
    except FloatingPointError as error:
        print(f"error: {error}", file=sys.stderr)
        code = 1
    except MemoryError as error:
        print(f"error: there is not memory enough: {error}", file=sys.stderr)
        code = 2
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        code = 130
    except BrokenPipeError:  # the reader, such as head, has seen enough
        code = 0
    except OSError as error:
        if error.filename is not None:  # it was no stream that could not be written
            raise
        code = _tell_unwritten(error)
    except SystemExit as error:
        if not isinstance(error.__context__, BrokenPipeError):
            raise
        code = 0  # rich makes the one of the other
    sys.exit(_flush(code))


def _open_streams() -> None:
    """Make standard streams that can be written to of those that were closed or know few characters."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:  # else the next file that is opened would be taken for it
            os.open(os.devnull, os.O_RDWR)
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "r+"))  # noqa: SIM115 - it is open until the process ends
        elif number and isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _flush(code: int) -> int:
    """Write what the streams still have in memory; returns the exit code, 2 where it cannot be written."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError as error:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())  # Python flushes once more at exit
            if not isinstance(error, BrokenPipeError) and stream is sys.stdout and code == 0:
                code = _tell_unwritten(error)
    return code


def _tell_unwritten(error: OSError) -> int:
    """Say that the output is not complete; returns the exit code."""
    print(f"error: cannot write the output: {error.strerror}", file=sys.stderr)
    return 2
