"""A clock of Numba's compilation, so that it does not count as training, and lines about its progress."""

from __future__ import annotations

import gc
import multiprocessing
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from numba.core import event

from hierroom.support.slow import FIRST_SECONDS, NEXT_SECONDS

COMPILE_EVENT = "numba:compile"
"""Numba's event when it compiles a function that is not on disk."""
ADVICE = "once; python -m hierroom compile does it ahead"


def compiling(event: event.Event) -> Any:
    """Return the kernel that an event is about."""
    assert event.data is not None
    return event.data["dispatcher"]


class CompileClock(event.Listener):
    """Adds up the time that this process compiles, and reports it on standard error if it is long.

    Python's garbage collector is off during compilation: with Numba's many objects, it took a tenth of the time.
    """

    def __init__(self) -> None:
        self._depth, self._started, self._done, self._n_kernels = 0, 0.0, 0.0, 0
        self._next_line, self._collects, self._is_heard = FIRST_SECONDS, False, True

    @property
    def seconds(self) -> float:
        """The seconds of compilation so far."""
        return self._done + (time.perf_counter() - self._started if self._depth else 0.0)

    def add(self, seconds: float) -> None:
        """Add time that was spent waiting for another process to compile."""
        self._done += seconds

    @contextmanager
    def quiet(self) -> Iterator[None]:
        """Print nothing in this context, because other lines report compilation."""
        was_heard, self._is_heard = self._is_heard, False
        try:
            yield
        finally:
            self._is_heard, self._next_line = was_heard, self.seconds + FIRST_SECONDS

    def on_start(self, event: event.Event) -> None:
        """Start the clock."""
        if self._depth == 0:
            self._started, self._collects = time.perf_counter(), gc.isenabled()
            gc.disable()
        self._depth += 1
        if compiling(event).py_func.__module__.startswith("hierroom."):
            self._n_kernels += 1
            self._say(compiling(event).__name__)

    def on_end(self, event: event.Event) -> None:
        """Stop the clock."""
        self._depth -= 1
        if self._depth == 0:
            self._done += time.perf_counter() - self._started
            if self._collects:
                gc.enable()

    def _say(self, kernel: str) -> None:
        # Workers stay silent: if they compile, their parent does, too.
        is_heard = self._is_heard and sys.stderr is not None and multiprocessing.parent_process() is None
        if is_heard and self.seconds >= self._next_line:
            self._next_line = self.seconds + NEXT_SECONDS
            so_far = f"{self._n_kernels} so far, in {self.seconds:.0f} s, now {kernel}"
            print(f"compiling kernels ({so_far}), {ADVICE}", file=sys.stderr, flush=True)


@cache
def compile_clock() -> CompileClock:
    """Return the clock of this process, which counts from the first call on."""
    clock = CompileClock()
    event.register(COMPILE_EVENT, clock)
    return clock
