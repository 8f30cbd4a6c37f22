"""How long Numba has compiled, so that compilation does not count as training."""

from __future__ import annotations

import time
from functools import cache
from typing import Any

from numba.core import event

COMPILE_EVENT = "numba:compile"
"""What Numba calls the compilation of one function; it is announced only where the function is not on disk."""


def compiling(event: event.Event) -> Any:
    """The kernel whose compilation such an event announces."""
    assert event.data is not None
    return event.data["dispatcher"]


class CompileClock(event.Listener):
    """Adds up the time that this process compiles; what is loaded from the cache on disk is not compiled again.

    Attributes:
        seconds: so far.
    """

    def __init__(self) -> None:
        self.seconds = 0.0
        self._depth = 0
        self._started = 0.0

    def on_start(self, event: event.Event) -> None:
        """Compilation of a function begins, maybe within that of another one."""
        if self._depth == 0:
            self._started = time.perf_counter()
        self._depth += 1

    def on_end(self, event: event.Event) -> None:
        """Compilation of a function ends."""
        self._depth -= 1
        if self._depth == 0:
            self.seconds += time.perf_counter() - self._started


@cache
def compile_clock() -> CompileClock:
    """The clock of this process, which runs from the first call on."""
    clock = CompileClock()
    event.register(COMPILE_EVENT, clock)
    return clock
