"""What a state may hold: a table of its entries with their types, shapes and ranges.

A state comes back from a file, and compiled kernels check no bounds. So each part of the package that can restore a
state describes it by a schema, and nothing of the state is used before `Schema.check` has found it right.
"""

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
"""The entries in another one: what each may be, what it is, and its name."""


class Schema:
    """What one entry of a state may be."""

    def check(self, value: Any, name: str) -> None:
        """Check an entry, and all that is in it.

        Args:
            value: the entry.
            name: its name, for the error message, such as ``levels.direction``.
        """
        waiting: _Parts = [(self, value, name)]
        for schema, value, name in waiting:
            waiting += schema._look(value, name)

    def _look(self, value: Any, name: str) -> _Parts:
        """Check an entry without what is in it; returns that."""
        raise NotImplementedError


class Anything(Schema):
    """Whatever there is: what a user's own code saves, and reads by itself."""

    def _look(self, value: Any, name: str) -> _Parts:
        return []


class AnyMapping(Schema):
    """A mapping, whose entries are checked elsewhere."""

    def _look(self, value: Any, name: str) -> _Parts:
        if not isinstance(value, Mapping):
            raise InputError(f"{name} must be a mapping, not {shown(value)}")
        return []


@dataclass(frozen=True)
class Table(Schema):
    """A mapping with certain entries.

    Args:
        entries: what each of them is, by name.
        optional: names of those that may be missing.
        is_open: whether other entries are allowed; they are not checked.
    """

    entries: Mapping[Any, Schema]
    optional: Collection[Any] = ()
    is_open: bool = False

    def _look(self, value: Any, name: str) -> _Parts:
        if not isinstance(value, Mapping):
            raise InputError(f"{name} must be a mapping, not {shown(value)}")
        missing = [repr(key) for key in self.entries if key not in value and key not in self.optional]
        unknown = [shown(key) for key in value if key not in self.entries and not self.is_open]
        if missing or unknown:
            wrong = [f"lacks {', '.join(missing)}"] * bool(missing) + [f"has {', '.join(unknown)}"] * bool(unknown)
            raise InputError(f"{name} does not hold what it should: it {' and '.join(wrong)}")
        return [(schema, value[key], f"{name}.{key}") for key, schema in self.entries.items() if key in value]


@dataclass(frozen=True)
class Items(Schema):
    """A list.

    Args:
        entry: what each item is.
        shortest: how many there are at least.
        longest: how many there are at most.
    """

    entry: Schema
    shortest: int = 0
    longest: float = math.inf

    def _look(self, value: Any, name: str) -> _Parts:
        if type(value) is not list or not self.shortest <= len(value) <= self.longest:
            number = "" if self.longest == math.inf else f" of {self.shortest} to {self.longest} items"
            given = f"a list of {len(value)}" if type(value) is list else shown(value)
            raise InputError(f"{name} must be a list{number}, not {given}")
        entry, parts = self.entry, enumerate(value)
        if isinstance(entry, Whole):  # there may be many of them
            parts = [(n, one) for n, one in parts if type(one) is not int or not entry.low <= one <= entry.high]
        return [(entry, one, f"{name}[{n}]") for n, one in parts]


@dataclass(frozen=True)
class Array(Schema):
    """An array of NumPy or a tensor of torch on the CPU.

    Args:
        dtype: its dtype, exactly.
        shape: its shape, exactly.
        low: smallest value, one for all or an array that broadcasts to the shape; None: no bound.
        high: largest value, likewise.
        is_finite: whether floats must be finite.
    """

    dtype: DTypeLike
    shape: tuple[int, ...]
    low: Any = None
    high: Any = None
    is_finite: bool = True

    def _look(self, value: Any, name: str) -> _Parts:
        dtype, array = np.dtype(self.dtype), value
        with suppress(AttributeError, TypeError, RuntimeError):
            array = value if isinstance(value, np.ndarray) else value.numpy()
        if not (isinstance(array, np.ndarray) and array.flags.c_contiguous):  # few are not as they should be
            array = as_array(value, name)
        if array.dtype != dtype or array.shape != self.shape:
            raise InputError(
                f"{name} must be an array of {dtype} and shape {self.shape}, not of {array.dtype} and shape "
                f"{array.shape}"
            )
        if dtype.kind == "b":  # compiled code reads one bit of it, NumPy all eight
            if array.view(np.uint8).max(initial=0) > 1:
                raise InputError(f"{name} must be True or False everywhere")
            return []
        if dtype.kind == "f" and self.is_finite and not np.isfinite(array).all():
            raise InputError(f"{name} must be finite everywhere, not {array[~np.isfinite(array)][0]}")
        for bound, is_broken, words in ((self.low, np.less, "at least"), (self.high, np.greater, "at most")):
            if bound is not None and len(broken := np.argwhere(is_broken(array, bound))):
                place = tuple(broken[0])
                allowed, where = np.broadcast_to(bound, self.shape)[place], list(map(int, place))
                raise InputError(f"{name} must be {words} {allowed}, not {array[place]}, which it is at {where}")
        return []


@dataclass(frozen=True)
class Whole(Schema):
    """A whole number, no bool.

    Args:
        low: the smallest.
        high: the largest.
    """

    low: int = 0
    high: float = math.inf

    def _look(self, value: Any, name: str) -> _Parts:
        is_whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
        if not is_whole or not self.low <= int(value) <= self.high:
            allowed = f"of at least {self.low}" if self.high == math.inf else f"from {self.low} to {_power(self.high)}"
            raise InputError(f"{name} must be a whole number {allowed}, not {shown(value)}")
        return []


@dataclass(frozen=True)
class Real(Schema):
    """A finite number, no bool.

    Args:
        low: the smallest.
    """

    low: float = -math.inf

    def _look(self, value: Any, name: str) -> _Parts:
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not is_number or not max(self.low, -sys.float_info.max) <= value <= sys.float_info.max:
            allowed = "a finite number" if self.low == -math.inf else f"a finite number of at least {self.low:g}"
            raise InputError(f"{name} must be {allowed}, not {shown(value)}")
        return []


@dataclass(frozen=True)
class Exactly(Schema):
    """One value and no other, of the same type all through.

    Args:
        value: the value, of plain types.
    """

    value: Any

    def _look(self, value: Any, name: str) -> _Parts:
        if type(value) is not type(self.value) or text_of(value) != text_of(self.value):
            raise InputError(f"{name} must be {shown(self.value)}, not {shown(value)}")
        return []


class Flag(Schema):
    """True or False."""

    def _look(self, value: Any, name: str) -> _Parts:
        if not isinstance(value, bool):
            raise InputError(f"{name} must be True or False, not {shown(value)}")
        return []


@dataclass(frozen=True)
class Row(Schema):
    """A list with one item for each schema.

    Args:
        entries: what each item is.
    """

    entries: tuple[Schema, ...]

    def _look(self, value: Any, name: str) -> _Parts:
        n = len(self.entries)
        if type(value) is not list or len(value) != n:
            given = f"a list of {len(value)}" if type(value) is list else shown(value)
            raise InputError(f"{name} must be a list of {n} items, not {given}")
        return [
            (schema, item, f"{name}[{i}]") for i, (schema, item) in enumerate(zip(self.entries, value, strict=True))
        ]


def of_records(dtype: np.dtype, n: int, bounds: Mapping[str, tuple[Any, Any]]) -> Table:
    """The schema of the fields of ``n`` records, each an array by its name.

    Args:
        dtype: of the records.
        n: how many.
        bounds: (low, high) of each field, as for `Array`; fields that are not named have none.
    """
    fields = {name: dtype[name] for name in dtype.names or ()}
    return Table({name: Array(f.base, (n, *f.shape), *bounds.get(name, ())) for name, f in fields.items()})


def like(example: Any, low: Any = None, high: Any = None, *, is_finite: bool = True) -> Schema:
    """The schema of arrays with the dtype and shape of another one.

    Args:
        example: an array or a tensor; one that NumPy cannot hold allows any value.
        low: as for `Array`.
        high: likewise.
        is_finite: likewise.
    """
    try:
        array = example if isinstance(example, np.ndarray) else example.detach().cpu().numpy()
    except (AttributeError, TypeError, RuntimeError):
        return Anything()
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
    """Check rules that relate several entries.

    Args:
        rules: each rule in words, and whether it holds: one answer, or one for each environment.
        what: what is to keep them, for the error message.
    """
    for rule, holds in rules.items():
        if not np.all(holds):
            where = f", but not in environment {int(np.argmin(holds))}" if np.ndim(holds) else ""
            raise InputError(f"{what} cannot be used: {rule}{where}")


def as_array(value: Any, name: str) -> NDArray:
    """An array, or a tensor of torch as one."""
    if isinstance(value, np.ndarray):
        array = value
    else:
        try:
            array = value.numpy()
        except (AttributeError, TypeError, RuntimeError):  # another type; a sparse tensor, one on another device, ...
            raise InputError(f"{name} must be an array, not {shown(value)}") from None
    extent = array.itemsize  # of what lies within a stride, the smallest first
    for stride, n in sorted([(abs(stride), n) for stride, n in zip(array.strides, array.shape, strict=True) if n > 1]):
        if stride < extent and array.size:
            raise InputError(f"{name} must be an array whose numbers each have a place of their own in memory")
        extent += stride * (n - 1)
    return array


def _power(number: float) -> str:
    """A whole number in digits, or where it is a large power of two less one as that."""
    number = int(number)
    bits = number.bit_length()
    return f"2**{bits} - 1" if bits > 20 and number == 2**bits - 1 else str(number)
