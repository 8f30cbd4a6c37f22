"""The clock of Numba's compilation, so that it does not count as training."""

from __future__ import annotations

import multiprocessing
import sys
import time
from functools import cache

from numba.core import event

COMPILE_EVENT = "numba:compile"
"""Numba's event when it compiles a function that is not on disk."""
PATIENCE_SECONDS = 2.0
LINE = "compiling kernels, once, for up to half a minute; python -m hierroom compile does it ahead"


class CompileClock(event.Listener):
    """Adds up the time that this process compiles; if it is long, one line on standard error says so.

    Attributes:
        may_speak: whether the line may still be printed. Worker processes are silent, as their parent compiles, too.
    """

    def __init__(self) -> None:
        self._depth, self._started, self._done = 0, 0.0, 0.0
        self.may_speak = multiprocessing.parent_process() is None

    @property
    def seconds(self) -> float:
        """The seconds of compilation so far."""
        return self._done + (time.perf_counter() - self._started if self._depth else 0.0)

    def on_start(self, event: event.Event) -> None:
        """Start the clock."""
        if self._depth == 0:
            self._started = time.perf_counter()
        self._depth += 1
        assert event.data is not None
        is_ours = event.data["dispatcher"].py_func.__module__.startswith("hierroom.")
        if self.may_speak and is_ours and self.seconds >= PATIENCE_SECONDS and sys.stderr is not None:
            self.may_speak = False
            print(LINE, file=sys.stderr, flush=True)

    def on_end(self, event: event.Event) -> None:
        """Stop the clock."""
        self._depth -= 1
        if self._depth == 0:
            self._done += time.perf_counter() - self._started


@cache
def compile_clock() -> CompileClock:
    """Return the clock of this process, which counts from the first call on."""
    clock = CompileClock()
    event.register(COMPILE_EVENT, clock)
    return clock
