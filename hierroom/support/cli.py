"""The commands, and how each ends: what went wrong is one line, and an input that cannot be used is exit code 2."""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, suppress
from pathlib import Path

from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from hierroom.support.errors import InputError, RunError, one_line

COMMANDS: Mapping[str, str] = {
    "train": "train an agent and write a run folder",
    "sweep": "train many runs, on every core or many machines, into one table",
    "play": "play a level yourself, with hints, fog, and a trained agent that can take over",
    "watch": "watch a trained agent, its failures too: in a window, as GIF, MP4 or text",
    "evaluate": "success, length and steps to each goal of a trained agent",
    "compare": "learning curves of several runs, with intervals, as tables and a figure",
    "report": "one HTML page on runs: curves, goals, complexity against learning, replay of episodes",
    "complexity": "how hard goal graphs are to explore, before anybody trains",
    "paper": "the paper's tables and figures, ours beside its own",
    "compile": "compile all kernels now, so that nothing waits for it later",
}
"""What people run, as ``python -m hierroom.NAME``, and what for."""

_WORDS = {
    "could not convert string to float:": "it must be a number, not",
    r"Could not parse arguments (\[.*\]) into tuple type typing\.Tuple\[[float, ]*\]": r"they must be numbers, not \1",
    r"no type matching \{None\}\|INT could be instantiated from \[(.*)\]": r"it must be a whole number or None, not \1",
}
"""What Python and tyro say of a text that is no number, in words for who typed it."""


_SEVERAL = {
    "--graph": ("goal graph", "a b"),
    "--graphs": ("goal graph", "a b"),
    "--exclude": ("goal graph", "a b"),
    "--metas": ("meta-controller", "random oracle"),
    "--features": ("feature", "view goal"),
    "--meta-features": ("feature", "view goal"),
}
"""Options of several: of what, and two of them."""


def program(name: str) -> str:
    """How a command was called, for its usage and for what completes it in a shell.

    Args:
        name: of the command, in `COMMANDS`.
    """
    return f"hierroom {name}" if Path(sys.argv[0]).stem == "hierroom" else f"python -m hierroom {name}"


def words(argv: Sequence[str] | None = None) -> list[str]:
    """The words of the command line, by default of this process."""
    given = [*(sys.argv[1:] if argv is None else argv)]
    for option, (of, several) in _SEVERAL.items():
        if sum(word.partition("=")[0].replace("_", "-") == option for word in given) > 1:
            raise InputError(f"{option} is given twice; give it once, with all its {of}s: {option} {several}")
        after = given[given.index(option) + 1 :] if option in given else [several]
        if not after or after[0].startswith("--"):
            raise InputError(f"{option} is given without a {of}; give at least one: {option} {several}")
    return given


@contextmanager
def one_line_usage(argv: Sequence[str] | None = None) -> Iterator[None]:
    """A context in which tyro reads a command line, and what it refuses becomes one line instead of a box.

    Args:
        argv: the words it reads, by default those of this process.
    """
    numbers = ConstructorRegistry()
    numbers.primitive_rule(_whole_number_rule)
    given, said, columns = sys.argv[1:] if argv is None else argv, io.StringIO(), os.environ.get("COLUMNS")
    is_help = not {"-h", "--help"}.isdisjoint(given)
    try:
        if not is_help:
            os.environ["COLUMNS"] = "100000"  # tyro breaks no line of the box, so that none has to be put together
        with redirect_stderr(said), numbers:
            yield
    except SystemExit as error:
        if error.code != 2:  # it was asked for help, or for what completes options in a shell
            raise
        raise InputError(_without_box(said.getvalue())) from None
    finally:
        if not is_help:
            os.environ.pop("COLUMNS")
            os.environ.update({} if columns is None else {"COLUMNS": columns})


def _whole_number_rule(type_info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec | None:
    """How tyro is to read a whole number: 1e6 too, as config files do."""
    if type_info.type is not int:
        return None
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar="INT",
        instance_from_str=lambda texts: _whole_number(texts[0]),
        is_instance=lambda value: isinstance(value, int),
        str_from_instance=lambda value: [str(value)],
    )


def _whole_number(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        with suppress(ValueError):
            if (number := float(text)).is_integer():
                return int(number)
        raise ValueError(f"it must be a whole number, not {text!r}") from None


def _without_box(text: str) -> str:
    """What tyro's box says, on one line: its first part, the options that are near to a wrong one, and how to go on."""
    lines = text.splitlines()
    rows = [line[2:].removesuffix("│").rstrip() for line in lines[1 if text.startswith("╭") else 2 : -1]]
    parts: list[list[str]] = [[]]
    for row in rows:  # a rule stands between two parts
        if row.strip("─-"):
            parts[-1].append(row)
        else:
            parts.append([])
    first, *others = ([row.strip() for row in part if not row.startswith(" " * 8)] for part in parts)
    message = " ".join(first).removeprefix("Error parsing ").replace(". Expected", "; expected")
    for python, ours in _WORDS.items():
        message = re.sub(python, ours, message)
    near = [row.split()[0] for part in others for row in part[1:2] if re.match("Perhaps|Arguments similar", part[0])]
    known = [
        row.replace("Available subcommands:", "there is")
        for part in others
        for row in part
        if row.startswith("Available")
    ]
    hints = [f"is it {' or '.join(sorted({*near}))}?"] * bool(near) + known
    help_of = [match[1] for part in others if (match := re.search(r"(\S[^│]* --help)", " ".join(part)))]
    advice = [re.sub("^For full helptext, (run:?|see) ", "see ", one) for one in help_of[-1:]]
    return "; ".join([message[:1].lower() + message[1:].removesuffix("."), *hints, *advice])


def _say(error: object) -> None:
    print(one_line(f"error: {error}"), file=sys.stderr)


def run(command: Callable[[], int]) -> None:
    """Run a command and leave the process with its exit code, or with 2 where an input cannot be used.

    Output that is closed, that nobody reads any more or that lacks a character is no failure.
    """
    _open_streams()
    try:
        code = command()
    except InputError as error:
        _say(error)
        code = 2
    except (FloatingPointError, RunError) as error:
        _say(error)
        code = 1
    except MemoryError as error:
        _say(f"there is not memory enough: {error}")
        code = 2
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        code = 130
    except BrokenPipeError:  # the reader, such as head, has seen enough
        code = 0
    except OSError as error:
        if error.filename is None:  # it was a stream that could not be written
            code = _tell_unwritten(error)
        else:  # such as a name that is too long, or a folder that may not be read
            _say(f"{error.strerror or error}: {os.fsdecode(error.filename)!r}")
            code = 2
    except RuntimeError as error:  # torch has no MemoryError
        if "allocate" not in str(error):
            raise
        _say(f"there is not memory enough: {error}")
        code = 2
    except SystemExit as error:
        if not isinstance(error.__context__, BrokenPipeError):
            raise
        code = 0  # rich makes the one of the other
    sys.exit(_flush(code))


def _open_streams() -> None:
    """Make standard streams that can be written to of those that were closed, know few characters or have no width."""
    if os.environ.get("COLUMNS") == "0":  # what some programs say where there is no terminal; rich would print nothing
        del os.environ["COLUMNS"]
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
    _say(f"cannot write the output: {error.strerror}")
    return 2
