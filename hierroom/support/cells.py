"""Cells of tables: numbers in the range of their column, and texts that no spreadsheet reads as a formula."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable
from contextlib import suppress
from functools import lru_cache
from typing import Any

from hierroom.support.errors import InputError, shown

_MOST = 2.0**62  # as in checkpoints; sums and plots of such numbers stay finite
_BEFORE = r"(?!achieved_|steps_to_|meta_)(.*_)?"  # users choose the names after these three
_WHOLE = re.compile(rf"steps|{_BEFORE}episodes")
_RANGES = {
    rf"{_BEFORE}(success(_rate|_low|_high)|score)|achieved_.*": (0.0, 1.0),
    rf"{_WHOLE.pattern}|seconds|{_BEFORE}(length|length_over_shortest)|steps_to_.*": (0.0, _MOST),
    rf"{_BEFORE}return": (-_MOST, _MOST),
}
"""The lowest and the highest number in columns, by regular expressions of their names."""
_FORMULA = re.compile(r"'*[=+\-@\t\r]")


def read_number(text: str, column: str, least: float | None = None) -> float:
    """Return the number in a cell; an empty cell is NaN. If there is a ``least`` number, NaN is refused."""
    low, high = _range_of(column) or (-math.inf, math.inf)
    low = low if least is None else max(low, least)
    value = None
    with suppress(ValueError):
        value = float(text or "nan")
    is_whole = _WHOLE.fullmatch(column) is not None
    is_known = value is not None and low <= value <= high and (value.is_integer() or not is_whole)
    if value is None or not (is_known or (math.isnan(value) and least is None)):
        kind = f"{'whole ' * is_whole}number{_bounds(low, high, value)}"
        raise InputError(f"{column} is a {kind}, not {shown(text)}")
    return value


def _bounds(low: float, high: float, value: float | None) -> str:
    if high == 1:
        return f" from {low:g} to 1"
    if value is not None and value > high:
        return f" of at most {high:.2g}"
    is_below = value is not None and value < low
    return f" of at least {low:.2g}" if low >= 0 or is_below else ""


def has_range(column: str) -> bool:
    """Return whether a column, by its name, has numbers of a known range."""
    return _range_of(column) is not None


@lru_cache(1000)
def _range_of(column: str) -> tuple[float, float] | None:
    return next((bounds for names, bounds in _RANGES.items() if re.fullmatch(names, column)), None)


def plain_cell(value: Any) -> Any:
    """Return a cell of a table; a text that a spreadsheet would read as a formula stands after an apostrophe."""
    is_formula = isinstance(value, str) and _FORMULA.match(value) and not _is_number(value)
    return f"'{value}" if is_formula else value


def join_names(names: Iterable[str], between: str) -> str:
    """Return names as one text, ``none`` without any; quote a name where two lists could otherwise look alike."""
    plain = [
        json.dumps(name, ensure_ascii=False) if between in name or name[:1] in ("", '"') or name == "none" else name
        for name in names
    ]
    return between.join(plain) or "none"


def text_of_cell(cell: str) -> str:
    """Return the text from a cell that `plain_cell` made."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def _is_number(text: str) -> bool:
    with suppress(ValueError):
        float(text)
        return True
    return False
