"""Arrays that are handed out at every step, and used again as soon as nobody holds them."""

from __future__ import annotations

from collections.abc import Callable
from sys import getrefcount
from typing import Any

from numpy.typing import NDArray

_Set = tuple[tuple[NDArray, ...], dict[str, NDArray]]


class ArrayPool:
    """Two sets of arrays that are handed out in turn: new ones, as far as anybody who gets them can tell.

    An array that nobody else holds, nor a view of it, would be freed and its memory given to the next one. This does
    the same without the way through the allocator, which at small batches takes longer than to fill the arrays, and
    at large ones has the operating system clear every page again. Whoever keeps an array of a set keeps it for good:
    the pool then makes another set.

    Args:
        make: makes a set: arrays that own their memory, and a dict of some of them by name.
    """

    def __init__(self, make: Callable[[], _Set]) -> None:
        self._make = make
        self._sets: list[_Set] = []
        self._free: list[int] = []  # how many hold each array while nobody else does
        self._at = 0

    def __reduce__(self) -> tuple[type[ArrayPool], tuple[Any]]:
        """A copy has arrays of its own."""
        return ArrayPool, (self._make,)

    def take(self) -> _Set:
        """A set of arrays, to be written, and the dict; whoever gives the dict away gives a copy."""
        if not self._sets:
            self._sets = [self._make(), self._make()]
            self._free = list(map(getrefcount, self._sets[0][0]))
        self._at ^= 1
        taken = self._sets[self._at]
        if list(map(getrefcount, taken[0])) != self._free:
            taken = self._sets[self._at] = self._make()
        return taken
