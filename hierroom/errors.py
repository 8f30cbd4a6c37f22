"""What a user gave and cannot be used, the check of a number, and how what was given is shown."""

from __future__ import annotations

import math

import numpy as np


class InputError(Exception):
    """What a user gave cannot be used; the message is one line: what was wrong, what is allowed, what was given."""


class DivergenceError(FloatingPointError):
    """Training has diverged; the message is one line: which numbers are not finite or far too large, and what to do."""


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


_MAX_CHARACTERS = 1000
"""Of a line: what was given may be a whole file."""


def one_line(text: str) -> str:
    """A text as one line that no terminal obeys: control characters escaped, and the middle of a long text cut.

    Args:
        text: any text.
    """
    plain = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    half = _MAX_CHARACTERS // 2
    return plain if len(plain) <= _MAX_CHARACTERS else f"{plain[:half]} ... {plain[-half:]}"
