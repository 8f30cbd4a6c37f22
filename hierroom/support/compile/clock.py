"""A clock of Numba's compilation, which does not count as training, and lines about it."""

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
"""Numba's event for the compilation of one function that is not on disk."""
ADVICE = "once; python -m hierroom compile does it ahead"


def compiling(event: event.Event) -> Any:
    """Return the kernel that such an event announces."""
    assert event.data is not None
    return event.data["dispatcher"]


class CompileClock(event.Listener):
    """Adds up the time that this process compiles, and says so on standard error once that is long.

    Meanwhile Python does not look for garbage: among Numba's many objects that took a tenth of the time.
    """

    def __init__(self) -> None:
        self._depth, self._started, self._done, self._n_kernels = 0, 0.0, 0.0, 0
        self._next_line, self._collects, self._is_heard = FIRST_SECONDS, False, True

    @property
    def seconds(self) -> float:
        """The time so far."""
        return self._done + (time.perf_counter() - self._started if self._depth else 0.0)

    def add(self, seconds: float) -> None:
        """Count time that was spent waiting for what another process compiles."""
        self._done += seconds

    @contextmanager
    def quiet(self) -> Iterator[None]:
        """Print nothing in this context, where other lines report compilation."""
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
        # Where workers compile, their parent does, too.
        is_heard = self._is_heard and sys.stderr is not None and multiprocessing.parent_process() is None
        if is_heard and self.seconds >= self._next_line:
            self._next_line = self.seconds + NEXT_SECONDS
            so_far = f"{self._n_kernels} so far, in {self.seconds:.0f} s, now {kernel}"
            print(f"compiling kernels ({so_far}), {ADVICE}", file=sys.stderr, flush=True)


@cache
def compile_clock() -> CompileClock:
    """Return the clock of this process, which runs from the first call on."""
    clock = CompileClock()
    event.register(COMPILE_EVENT, clock)
    return clock
