"""Commands: reading their arguments, errors on one line, and exit code 2 for invalid input."""

from __future__ import annotations

import errno
import gc
import io
import os
import re
import shlex
import signal
import sys
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import tyro
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from hierroom.support.errors import InputError, RunError, one_line

if TYPE_CHECKING:
    from rich.progress import Progress

T = TypeVar("T")
Flag = Annotated[bool, tyro.conf.FlagCreatePairsOff]
"""An option without a value; it has no negated form, such as --no-json."""
LISTS = (*("--graph", "--graphs", "--exclude", "--layout", "--rules", "--metas", "--features"), "--meta-features")
"""Options with several values."""
_NUMBERS = ConstructorRegistry()
_NO_OUTPUT = "cannot write the output: "
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")  # Gymnasium's warnings have some
_UNWRITTEN = {errno.ENOSPC, errno.EFBIG, errno.EIO}  # without a file name; our own files' errors have one


def read_arguments(kind: type[T], command: str, argv: Sequence[str], default: T | None = None) -> T:
    """Read the words after a command's name into a dataclass, or one of a union; on an error, exit with code 2."""
    written = names_of(argv)
    for option in LISTS:  # tyro would read no values, or drop the first ones
        if written.count(option) > 1:
            raise InputError(f"{option} is given twice; give it once, with all its values")
        if option in argv and (argv[-1] == option or argv[argv.index(option) + 1].startswith("--")):
            raise InputError(f"{option} is given without a value; give at least one")
    start = tyro.MISSING_NONPROP if default is None else default
    return tyro.cli(kind, prog=f"python -m hierroom {command}", args=argv, default=start, registry=_NUMBERS)


def names_of(argv: Sequence[str]) -> list[str]:
    """Return the words of a command line without values, and options as they are written with dashes."""
    return [word.partition("=")[0].replace("_", "-") if word.startswith("--") else word for word in argv]


def given(arguments: object, *names: str) -> dict[str, Any]:
    """Return the named options that have a value."""
    values = {name: getattr(arguments, name) for name in names}
    return {name: value for name, value in values.items() if value not in (None, ())}


def refuse_without(arguments: object, partner: str, *names: str) -> None:
    """Refuse the named options unless they have their defaults, as they have an effect only with ``partner``."""
    if not (value := getattr(arguments, partner)):
        for name in names:
            if getattr(arguments, name) != getattr(type(arguments), name):
                missing = "which is missing" if value is None or value is False else f"which is {value}"
                raise InputError(f"--{name} goes with --{partner}, {missing}".replace("_", "-"))


def shell_words(*words: str | Path) -> str:
    """Return the words of a command, quoted for a shell; a path that begins with a dash gets ``./`` before it."""
    return " ".join(map(_quoted, words))


def _quoted(word: str | Path) -> str:
    text = str(word)
    before = "./" if isinstance(word, Path) and text.startswith("-") else ""
    if text.isprintable():
        return before + shlex.quote(text)
    plain = (c if c.isprintable() and c not in "\\'" else "".join(f"\\x{b:02x}" for b in os.fsencode(c)) for c in text)
    return f"{before}$'{''.join(plain)}'"


def progress_bar() -> Progress:
    """Return a progress bar on standard error, shown only on a terminal and removed at its end."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    return Progress(console=console, transient=True, disable=not console.is_terminal)


@_NUMBERS.primitive_rule
def _read_whole_numbers(type_info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec | None:
    if type_info.type is not int:
        return None
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar="INT",
        instance_from_str=lambda words: _whole_number(words[0]),
        is_instance=lambda value: isinstance(value, int),
        str_from_instance=lambda value: [str(value)],
    )


def _whole_number(text: str) -> int:
    with suppress(ValueError):
        return int(text)
    with suppress(ValueError):
        if (number := float(text)).is_integer():
            return int(number)
    raise ValueError(f"it must be a whole number, not {text!r}")


def run(command: Callable[[], int]) -> None:
    """Run a command and exit with its code, or 2 for invalid input; closed or unread output is not a failure."""
    _open_streams()
    warnings.formatwarning = lambda message, *_, **__: one_line(f"warning: {_COLOURS.sub('', str(message))}") + "\n"
    try:
        code = command()
    except KeyboardInterrupt:
        _say("stopped")
        code = 130
    except BrokenPipeError:  # the reader, such as head, has stopped
        code = 0
    except SystemExit as error:  # from rich for a broken pipe; from tyro after --help and wrong options
        code = 0 if isinstance(error.__context__, BrokenPipeError) else error.code
    except Exception as error:
        code = _report(error)
    if signal.getsignal(signal.SIGINT) != signal.SIG_IGN:  # another Ctrl-C ends Python's work at exit silently
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    gc.freeze()  # else Python collects garbage at exit, for seconds on a busy machine
    sys.exit(_flush(code))


def _report(error: Exception) -> int:
    code, message = _failure(error)
    _say(one_line(f"error: {message}"))
    return code


def _say(line: str) -> None:
    with suppress(OSError):  # a lost line does not change the exit code
        print(line, file=sys.stderr)


def _failure(error: Exception) -> tuple[int, str]:
    match error:
        case InputError():
            return 2, str(error)
        case FloatingPointError() | RunError():
            return 1, str(error)
        case OSError(filename=None):
            return 2, f"{_NO_OUTPUT * (error.errno in _UNWRITTEN)}{error.strerror or error}"
        case OSError():  # such as a name that is too long, or a folder without permission
            return 2, f"{error.strerror or error}: {os.fsdecode(error.filename)!r}"
    if isinstance(error, MemoryError) or (isinstance(error, RuntimeError) and "allocate" in str(error)):  # from torch
        return 2, f"not enough memory: {error}"
    raise error


def _open_streams() -> None:
    """Replace closed standard streams, and make the others escape characters that their encodings lack."""
    if len(os.environ.get("COLUMNS", "80")) < 2:  # some programs without a terminal set 0
        del os.environ["COLUMNS"]  # else rich would print nothing, and tyro would never end its help
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:  # else the next opened file would get its number
            os.open(os.devnull, os.O_RDWR)
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "r+", encoding="utf-8"))  # noqa: SIM115 - it is open until the process ends
        elif number and isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _flush(code: int | str | None) -> int | str | None:
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError as error:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())  # Python flushes once more at exit
            if not isinstance(error, BrokenPipeError) and stream is sys.stdout and not code:
                code = _report(InputError(f"{_NO_OUTPUT}{error.strerror}"))
    return code
