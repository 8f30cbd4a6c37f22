"""Arrays for every step, used again when nobody holds them any more."""

from __future__ import annotations

from collections.abc import Callable
from sys import getrefcount
from typing import Any

from numpy.typing import NDArray

_Set = tuple[tuple[NDArray, ...], dict[str, NDArray]]


class ArrayPool:
    """Two sets of arrays that take turns, as allocation is slow; a set with an array still held is replaced.

    ``make`` makes a set: arrays that own their memory, and a dict of some of them by name.
    """

    def __init__(self, make: Callable[[], _Set]) -> None:
        self._make = make
        self._sets: list[_Set] = []
        self._free: list[int] = []  # the number of references to each array while nobody else holds one
        self._at = 0

    def __reduce__(self) -> tuple[type[ArrayPool], tuple[Any]]:
        """Give each copy its own arrays."""
        return ArrayPool, (self._make,)

    def take(self) -> _Set:
        """Return a set of arrays to write, and the dict; whoever passes the dict on passes a copy."""
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
