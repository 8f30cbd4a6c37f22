"""Arrays for every step, reused when no reference is left."""

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
        self._at ^= 1
        taken = self._sets[self._at]
        if list(map(getrefcount, taken[0])) != self._free:
            taken = self._sets[self._at] = self._make()
        return taken
