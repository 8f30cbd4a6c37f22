"""Arrays that are reused in each step once no reference to them is left."""

from __future__ import annotations

from collections.abc import Callable
from sys import getrefcount
from typing import Any

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
