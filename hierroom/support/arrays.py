"""Arrays that only their owner may write, and arrays that are reused in each step once no reference to them is left."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from sys import getrefcount
from typing import Any

import numpy as np


def read_only(array: np.ndarray) -> np.ndarray:
    """Return a read-only view of an array; changes by the array's owner are visible in it."""
    view = array.view()
    view.setflags(write=False)
    return view


class Shown:
    """A read-only attribute ``name``: a view of the array that the object keeps as ``_name``."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._kept_as = f"_{name}"

    def __get__(self, instance: Any, owner: type | None = None) -> np.ndarray:
        return read_only(getattr(instance, self._kept_as))


def freeze(value: Any) -> Any:
    """Make an array, or the arrays in an object or a mapping, read-only; return the same value."""
    held = value.values() if isinstance(value, Mapping) else getattr(value, "__dict__", {}).values()
    for array in (value, *held):
        if isinstance(array, np.ndarray):
            array.setflags(write=False)
    return value


_Set = tuple[tuple[Any, ...], Any]


class ArrayPool:
    """Reuses two sets of arrays, as allocation is slow, but no set with an array that a caller still holds.

    ``make`` returns a set: all its arrays, including the owners of views and other objects that a caller may hold, and
    any object that holds some of them. The set used last is tried first, as it is still in the processor's cache.
    """

    def __init__(self, make: Callable[[], _Set]) -> None:
        self._make = make
        self._sets: list[_Set] = []
        self._free: list[int] = []  # the number of references to each array if no caller holds it
        self._at = 0

    def __reduce__(self) -> tuple[type[ArrayPool], tuple[Any]]:
        """Give each copy its own arrays."""
        return ArrayPool, (self._make,)

    def take(self) -> _Set:
        """Return a set of arrays to write, and the object that holds them; if that is a dict, pass on copies of it."""
        if not self._sets:
            self._sets = [self._make(), self._make()]
            self._free = list(map(getrefcount, self._sets[0][0]))
        if not self._is_free():
            self._at ^= 1
            if not self._is_free():
                self._sets[self._at] = self._make()
        return self._sets[self._at]

    def _is_free(self) -> bool:
        arrays, free = self._sets[self._at][0], self._free
        return getrefcount(arrays[0]) == free[0] and list(map(getrefcount, arrays)) == free
