"""What a user gave and cannot be used, the check of a number, and how what was given is shown."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

import numpy as np


class InputError(Exception):
    """What a user gave cannot be used; the message is one line: what was wrong, what is allowed, what was given."""

    def __str__(self) -> str:
        """The message, on one line whatever was given."""
        return one_line(super().__str__())


class DivergenceError(FloatingPointError):
    """Training has diverged; the message is one line: which numbers are not finite or far too large, and what to do."""


class RunError(Exception):
    """Runs have failed, whatever was given; the message is one line: how many, one of them, and why."""


def require_number(name: str, value: object, low: float, high: float = math.inf, *, is_whole: bool = False) -> None:
    """Refuse what is not a finite number of a range.

    Args:
        name: of the value, for the message.
        value: what was given.
        low: the least that is allowed.
        high: the most that is allowed.
        is_whole: whether only whole numbers are.

    Raises:
        InputError: if the value is another.
    """
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
    """Refuse what is not one of some names.

    Args:
        name: of the value and a verb, for the message.
        value: what was given, anything at all.
        allowed: the names, and None where that is allowed.

    Raises:
        InputError: if the value is none of them.
    """
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


_MAX_CHARACTERS = 1000
"""Of a line: what was given may be a whole file."""


def one_line(text: str) -> str:
    """A text as one line that no terminal obeys: control characters escaped, and the middle of a long text cut.

    Args:
        text: any text.
    """
    plain = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    half = (_MAX_CHARACTERS - len(" ... ")) // 2
    return plain if len(plain) <= _MAX_CHARACTERS else f"{plain[:half]} ... {plain[-half:]}"
