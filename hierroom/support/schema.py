"""Schemas of states from files: types, shapes and ranges. They are checked because kernels do not check bounds."""

from __future__ import annotations

import math
import sys
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from hierroom.support.errors import InputError, shown, text_of

_Parts = list[tuple["Schema", Any, str]]
"""The entries inside an entry: the schema, value and name of each."""


class Schema:
    """The allowed values of one entry of a state; this class allows all, subclasses restrict them."""

    def check(self, value: Any, name: str) -> None:
        """Check an entry called ``name``, such as ``levels.direction``, and all entries inside it."""
        waiting: _Parts = [(self, value, name)]
        for schema, value, name in waiting:
            waiting += schema._look(value, name) or ()

    def _look(self, value: Any, name: str) -> _Parts | None:
        """Check an entry without the entries inside it, and return these, if there are any."""


@dataclass(frozen=True)
class Table(Schema):
    """A mapping with certain entries."""

    entries: Mapping[Any, Schema]
    optional: Collection[Any] = ()  # names of entries that may be missing
    is_open: bool = False  # whether other entries are allowed, unchecked

    def _look(self, value: Any, name: str) -> _Parts:
        if not isinstance(value, Mapping):
            raise InputError(f"{name} must be a mapping, not {shown(value)}")
        missing = [repr(key) for key in self.entries if key not in value and key not in self.optional]
        unknown = [shown(key) for key in value if key not in self.entries and not self.is_open]
        if missing or unknown:
            wrong = [
                f"{verb} {', '.join(keys)}" for verb, keys in (("lacks", missing), ("has the unknown", unknown)) if keys
            ]
            raise InputError(f"{name} {' and '.join(wrong)}")
        return [(schema, value[key], f"{name}.{key}") for key, schema in self.entries.items() if key in value]


ANY_MAPPING = Table({}, is_open=True)


@dataclass(frozen=True)
class Items(Schema):
    """A list of ``shortest`` to ``longest`` items."""

    entry: Schema
    shortest: int = 0
    longest: float = math.inf

    def _look(self, value: Any, name: str) -> _Parts:
        if type(value) is not list or not self.shortest <= len(value) <= self.longest:
            number = "" if self.longest == math.inf else f" of {self.shortest} to {self.longest} items"
            given = f"a list of {len(value)}" if type(value) is list else shown(value)
            raise InputError(f"{name} must be a list{number}, not {given}")
        entry, parts = self.entry, enumerate(value)
        if isinstance(entry, Whole):  # faster, as there may be many items
            parts = [(n, one) for n, one in parts if type(one) is not int or not entry.low <= one <= entry.high]
        return [(entry, one, f"{name}[{n}]") for n, one in parts]


@dataclass(frozen=True)
class Array(Schema):
    """A NumPy array or a torch tensor on the CPU."""

    dtype: DTypeLike
    shape: tuple[int, ...]
    low: Any = None  # the smallest value, as one number or an array that broadcasts to the shape; None: no bound
    high: Any = None  # the largest value
    is_finite: bool = True  # whether floats must be finite

    def _look(self, value: Any, name: str) -> None:
        is_simple = type(value) is np.ndarray and value.flags.c_contiguous
        dtype, array = np.dtype(self.dtype), value if is_simple else as_array(value, name)
        if array.dtype != dtype or array.shape != self.shape:
            wanted, found = f"{dtype} and shape {self.shape}", f"{array.dtype} and shape {array.shape}"
            raise InputError(f"{name} must be an array of {wanted}, not of {found}")
        if dtype.kind == "b":  # compiled code reads one bit of a bool, NumPy all eight
            if array.view(np.uint8).max(initial=0) > 1:
                raise InputError(f"{name} must be True or False everywhere")
            return
        if dtype.kind == "f" and self.is_finite and not np.isfinite(array).all():
            raise InputError(f"{name} must be finite everywhere, not {array[~np.isfinite(array)][0]}")
        for bound, is_broken, words in ((self.low, np.less, "at least"), (self.high, np.greater, "at most")):
            if bound is not None and len(broken := np.argwhere(is_broken(array, bound))):
                place = tuple(broken[0])
                allowed, where = np.broadcast_to(bound, self.shape)[place], list(map(int, place))
                raise InputError(f"{name} must be {words} {allowed}, not {array[place]} (at {where})")


@dataclass(frozen=True)
class Whole(Schema):
    """A whole number, not a bool."""

    low: int = 0
    high: float = math.inf

    def _look(self, value: Any, name: str) -> None:
        is_whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
        if not is_whole or not self.low <= int(value) <= self.high:
            allowed = f"of at least {self.low}" if self.high == math.inf else f"from {self.low} to {_power(self.high)}"
            raise InputError(f"{name} must be a whole number {allowed}, not {shown(value)}")


class Real(Schema):
    """A finite number, not a bool."""

    def _look(self, value: Any, name: str) -> None:
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not is_number or not abs(value) <= sys.float_info.max:
            raise InputError(f"{name} must be a finite number, not {shown(value)}")


@dataclass(frozen=True)
class Exactly(Schema):
    """One value of plain types, of the same type too: 1 is not 1.0."""

    value: Any

    def _look(self, value: Any, name: str) -> None:
        is_same = value is self.value or (type(value) is type(self.value) and text_of(value) == text_of(self.value))
        if not is_same:
            raise InputError(f"{name} must be {shown(self.value)}, not {shown(value)}")


class Flag(Schema):
    """True or False."""

    def _look(self, value: Any, name: str) -> None:
        if not isinstance(value, bool):
            raise InputError(f"{name} must be True or False, not {shown(value)}")


def record_type(*fields: tuple) -> np.dtype:
    """Return the type of records with these fields, aligned for compiled kernels."""
    return np.dtype((np.record, np.dtype([*fields], align=True)))


def of_records(dtype: np.dtype, n: int, bounds: Mapping[str, tuple[Any, Any]]) -> Table:
    """Return the schema of the fields of ``n`` records; ``bounds`` has (low, high) of some fields, as in `Array`."""
    fields = {name: dtype[name] for name in dtype.names or ()}
    return Table({name: Array(f.base, (n, *f.shape), *bounds.get(name, ())) for name, f in fields.items()})


def like(example: Any, low: Any = None, high: Any = None, *, is_finite: bool = True) -> Schema:
    """Return the schema of arrays like an array or tensor; if NumPy cannot hold that, any value is allowed."""
    try:
        array = example if isinstance(example, np.ndarray) else example.detach().cpu().numpy()
    except (AttributeError, TypeError, RuntimeError):
        return Schema()
    return Array(array.dtype, array.shape, low, high, is_finite)


RANDOM_STATE = Table(
    {
        "bit_generator": Exactly("PCG64"),
        "state": Table({"state": Whole(0, 2**128 - 1), "inc": Whole(0, 2**128 - 1)}),
        "has_uint32": Whole(0, 1),
        "uinteger": Whole(0, 2**32 - 1),
    }
)
"""The state of NumPy's default generator of random numbers."""


def require(rules: Mapping[str, NDArray[np.bool_] | np.bool_ | bool], what: str) -> None:
    """Check rules between entries of ``what``: each rule in words, with whether it holds, in all or per environment."""
    for rule, holds in rules.items():
        if not np.all(holds):
            where = f", but not in environment {int(np.argmin(holds))}" if np.ndim(holds) else ""
            raise InputError(f"{what} cannot be used: {rule}{where}")


def as_array(value: Any, name: str) -> NDArray:
    """Return an array, or a tensor as an array; refuse one with entries that share memory."""
    array = value
    if not isinstance(value, np.ndarray):
        with suppress(AttributeError, TypeError, RuntimeError):  # such as a sparse tensor, or one on another device
            array = value.numpy()
    if not isinstance(array, np.ndarray):
        raise InputError(f"{name} must be an array, not {shown(value)}")
    if array.flags.c_contiguous:
        return array
    extent = array.itemsize  # bytes from first to last number, over the smaller strides
    for stride, n in sorted([(abs(stride), n) for stride, n in zip(array.strides, array.shape, strict=True) if n > 1]):
        if stride < extent and array.size:
            raise InputError(f"{name} must be an array without numbers that share memory")
        extent += stride * (n - 1)
    return array


def _power(number: float) -> str:
    """Return a whole number as digits; if it is a large power of two minus one, as such."""
    number = int(number)
    bits = number.bit_length()
    return f"2**{bits} - 1" if bits > 20 and number == 2**bits - 1 else str(number)
