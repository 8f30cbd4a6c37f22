"""Errors for invalid input, checks of numbers and names, and errors in a user's code as one line."""

from __future__ import annotations

import math
import os
import sysconfig
import traceback
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import numpy as np


class InputError(Exception):
    """What a user gave cannot be used; the message is one line: what was wrong, what is allowed, what was given."""

    def __str__(self) -> str:
        """The message, on one line whatever was given."""
        return one_line(super().__str__())


class CheckpointError(InputError):
    """A checkpoint that is damaged, or was written in another format."""


class DivergenceError(FloatingPointError):
    """Training has diverged; the message is one line: which numbers are not finite or far too large, and what to do."""


class RunError(Exception):
    """Runs have failed, whatever was given; the message is one line: how many, one of them, and why."""


def require_number(name: str, value: object, low: float, high: float = math.inf, *, is_whole: bool = False) -> None:
    """Refuse a value, called ``name`` in the message, that is not a finite (and whole) number from low to high."""
    kinds = (int, np.integer) if is_whole else (int, float, np.number)
    if not isinstance(value, kinds) or isinstance(value, bool):
        raise InputError(f"{name} must be a {'whole ' * is_whole}number, not {value!r}")
    if not (low <= value <= high and abs(value) < math.inf):  # pyright: ignore[reportOperatorIssue] - it is a number
        bound = f"from {low} to {high}" if high < math.inf else f"at least {low}"
        if is_whole:
            bound = f"at least {low}" if value < low else f"at most {high}"  # pyright: ignore[reportOperatorIssue]
        elif high == math.inf and not math.isfinite(value):  # pyright: ignore[reportArgumentType] - it is a number
            bound = "finite"
        raise InputError(f"{name} must be {bound}, not {value}")


def require_name(name: str, value: object, allowed: Collection[str | None]) -> None:
    """Refuse what is not one of the allowed names or None; ``name`` is that of the value and a verb."""
    if not (value is None or isinstance(value, str)) or value not in allowed:
        names = ", ".join(one for one in allowed if one is not None)
        raise InputError(f"{name} {names}{' or None' * (None in allowed)}, not {shown(value)}")


def shown(value: Any) -> str:
    """A value in a few words, on one line."""
    if isinstance(value, (str, bytes, int, float, type(None))) or not hasattr(value, "__len__"):
        text = text_of(value)
        return text if len(text) <= 60 else f"{text[:57]}..."
    return f"a {type(value).__name__}"


def text_of(value: Any) -> str:
    """A value as Python writes it, on one line, or what it is if that is too much."""
    try:
        return " ".join(repr(value).split())
    except (ValueError, RecursionError):  # a number of thousands of digits; lists in lists in lists ...
        return f"a huge {type(value).__name__}"
    except Exception:  # a user's own class may have a __repr__ that fails
        return f"a {type(value).__name__}"


_MAX_CHARACTERS = 1000
"""Of a line: what was given may be a whole file."""


def one_line(text: str) -> str:
    """A text as one line that no terminal obeys: control characters escaped, and the middle of a long text cut."""
    plain = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    half = (_MAX_CHARACTERS - len(" ... ")) // 2
    return plain if len(plain) <= _MAX_CHARACTERS else f"{plain[:half]} ... {plain[-half:]}"


@contextmanager
def own_code(name: str) -> Iterator[None]:
    """A context in which a user's code runs, called ``name`` in the one line that whatever it raises becomes."""
    try:
        yield
    except (Exception, SystemExit) as error:  # a user's code may raise anything
        raise_told(name, error)


def raise_told(name: str, error: BaseException) -> NoReturn:
    """Raise what a user's code raised, as one line; for code that runs so often that `own_code` would slow it down."""
    if isinstance(error, (InputError, DivergenceError)):
        raise error
    raise InputError(f"{name} fails: {in_one_line(error)}") from error


def in_one_line(error: BaseException) -> str:
    """The type and message of an error on one line, with the last line of a user's code that led to it."""
    if isinstance(error, (InputError, DivergenceError)):
        return str(error)
    try:
        message = " ".join(str(error).split())
    except Exception:  # a user's own class of errors may have a __str__ that fails
        message = "its message cannot be read"
    text = f"{type(error).__name__}: {message}"
    places = [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(_NOT_OWN)]
    return f"{text} (line {places[-1].lineno} of {places[-1].filename})" if places else text


_LIBRARIES = {sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")}
_NOT_OWN = ("<", *(f"{folder}{os.sep}" for folder in (Path(__file__).parents[1], *_LIBRARIES)))
"""How the names of files begin that are not a user's own: this package's, Python's, and what is installed."""
