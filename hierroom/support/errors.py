"""Errors for invalid input, checks of a user's numbers and names, and errors of a user's code on one line."""

from __future__ import annotations

import math
import os
import re
import sysconfig
import traceback
import warnings
from collections.abc import Collection
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from hierroom.support.interrupt import awaited


class InputError(Exception):
    """Error for invalid user input, with a message on one line: the fault, the allowed values, the given value.

    Examples:
        >>> try:
        ...     hierroom.env(size=3)
        ... except hierroom.InputError as error:
        ...     print(error)
        size must be a whole number from 11 to 63, not 3
    """

    def __str__(self) -> str:
        """Return the message on one line."""
        return one_line(super().__str__())


class CheckpointError(InputError):
    """Error for a damaged checkpoint, or one in another format."""


class DivergenceError(FloatingPointError):
    """Error for diverged training, with a message on one line: the numbers too large or not finite, and advice."""


class RunError(Exception):
    """Error for runs that fail with valid input, with a message on one line."""


def require_number(name: str, value: object, low: float, high: float = math.inf, *, is_whole: bool = False) -> None:
    """Refuse a value, called ``name`` in the message, unless it is a finite (or whole) number from low to high."""
    kinds = (int, np.integer) if is_whole else (int, float, np.integer, np.floating)
    if not isinstance(value, kinds) or isinstance(value, bool):
        raise InputError(f"{name} must be a {'whole ' * is_whole}number, not {shown(value)}")
    if not (low <= value <= high and abs(value) < math.inf):  # pyright: ignore[reportOperatorIssue] - it is a number
        bound = f"from {low} to {high}" if high < math.inf else f"at least {low}"
        if is_whole:
            bound = f"at least {low}" if value < low else f"at most {high}"  # pyright: ignore[reportOperatorIssue]
        elif high == math.inf and not abs(value) < math.inf:  # pyright: ignore[reportArgumentType] - it is a number
            bound = "finite"
        given = value.item() if isinstance(value, np.generic) else value
        raise InputError(f"{name} must be {bound}, not {shown(given)}")


def use_python_numbers(config: Any) -> None:
    """Replace NumPy's numbers in a frozen dataclass by Python's, which do not overflow and can be written to files."""
    for entry in fields(config):
        if isinstance(value := getattr(config, entry.name), np.generic):
            object.__setattr__(config, entry.name, value.item())


def require_name(name: str, value: object, allowed: Collection[str | None]) -> None:
    """Refuse a value that is not allowed; the message begins with ``name``, such as ``render_mode must be one of``."""
    if not (value is None or isinstance(value, str)) or value not in allowed:
        names = ", ".join(one for one in allowed if one is not None)
        raise InputError(f"{name} {names}{' or None' * (None in allowed)}, not {shown(value)}")


def shown(value: Any) -> str:
    """Return a short text for a value, on one line."""
    if isinstance(value, (str, bytes, int, float, type(None))) or not hasattr(value, "__len__"):
        text = text_of(value)
        return text if len(text) <= 60 else f"{text[:57]}..."
    return f"a {type(value).__name__}"


def text_of(value: Any) -> str:
    """Return a value as Python writes it, on one line, or its type if that fails."""
    try:
        return " ".join(repr(value).split())
    except (ValueError, RecursionError):  # a number with thousands of digits, or deeply nested lists
        return f"a huge {type(value).__name__}"
    except Exception:  # a user's own class may have a __repr__ that fails
        return f"a {type(value).__name__}"


_COLOURS = re.compile(r"\x1b\[[\d;]*m")  # of a terminal
_MAX_CHARACTERS = 1000  # of a line, as a message may quote a whole file


def one_line(text: str) -> str:
    """Return a text as one safe line: escape control characters, and cut the middle of a long text."""
    plain = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    half = (_MAX_CHARACTERS - len(" ... ")) // 2
    return plain if len(plain) <= _MAX_CHARACTERS else f"{plain[:half]} ... {plain[-half:]}"


class user_code(awaited):
    """A context for code of the user, called ``name`` in messages: any error except Ctrl-C becomes an `InputError`.

    If the code changes the working folder, it is changed back, because a command may have relative paths.
    """

    __slots__ = ("_fails", "_folder")

    def __init__(self, name: str, fails: str = "fails") -> None:
        super().__init__(name)
        self._fails = fails

    def __enter__(self) -> None:
        super().__enter__()
        self._folder = _working_folder()

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        super().__exit__()
        if self._folder is not None and _working_folder() != self._folder:
            os.chdir(self._folder)
            warn_once(f"{self._name} changes the working folder, which is {self._folder} again")
        if error is not None and not isinstance(error, (InputError, DivergenceError, KeyboardInterrupt)):
            raise_in_one_line(self._name, error, self._fails)


def raise_in_one_line(name: str, error: BaseException, fails: str = "fails") -> NoReturn:
    """Raise an error of the user's code, called ``name``, as an `InputError` with a message on one line."""
    raise InputError(f"{name} {fails}: {in_one_line(error)}") from error


def _working_folder() -> str | None:
    try:
        return os.getcwd()
    except OSError:  # it was deleted
        return None


@cache
def warn_once(text: str) -> None:
    """Give a Python warning, but only once for each text in this process."""
    warnings.warn(text, stacklevel=2)


def in_one_line(error: BaseException) -> str:
    """Return the type and message of an error on one line, with the last line of the user's code in its traceback."""
    if isinstance(error, (InputError, DivergenceError)):
        return str(error)
    try:
        message = " ".join(_COLOURS.sub("", str(error)).split())
    except Exception:  # a user's own class of errors may have a __str__ that fails
        message = "its message cannot be read"
    text = f"{type(error).__name__}: {message}"
    places = [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(_NOT_OWN)]
    return f"{text} (line {places[-1].lineno} of {places[-1].filename})" if places else text


LIBRARIES = {sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")}
"""Folders of Python and of installed packages."""
_NOT_OWN = ("<", *(f"{folder}{os.sep}" for folder in (Path(__file__).parents[1], *LIBRARIES)))
"""Prefixes of the paths of files that are not the user's: those of this package, Python, and installed packages."""
