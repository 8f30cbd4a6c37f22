"""Clocks of Numba's compilation, so that it does not count as training, and of the activities of a session."""

from __future__ import annotations

import multiprocessing
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
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


class TimeSpent:
    """Seconds by activity; Numba's compilation is an activity of its own, whichever activity waits for it.

    Args:
        started: value of `time.perf_counter` when the process began; None: the session begins now.
    """

    def __init__(self, started: float | None = None) -> None:
        self._clock, self._seconds = compile_clock(), dict[str, float]()
        self._started = time.perf_counter() if started is None else started
        self._compiled = self._clock.seconds if started is None else 0.0

    def end_of_imports(self) -> None:
        """Count the time until now as importing, except compilation."""
        self._seconds["importing"] = time.perf_counter() - self._started - (self._clock.seconds - self._compiled)

    @contextmanager
    def on(self, what: str) -> Iterator[None]:
        """Count the time in this context for an activity, except compilation."""
        started, compiled = time.perf_counter(), self._clock.seconds
        try:
            yield
        finally:
            spent = time.perf_counter() - started - (self._clock.seconds - compiled)
            self._seconds[what] = self._seconds.get(what, 0.0) + spent

    def seconds(self) -> dict[str, float]:
        """Return the seconds so far of each activity, of the rest (such as files), and the total."""
        total = time.perf_counter() - self._started
        known = {**self._seconds, "compiling": self._clock.seconds - self._compiled}
        return {**known, "the rest": total - sum(known.values()), "total": total}

    def __str__(self) -> str:
        """Return the total and the time of each activity, the longest first."""
        seconds = self.seconds()
        total = seconds.pop("total")
        parts = (f"{what} {spent:.1f}" for what, spent in sorted(seconds.items(), key=lambda one: -one[1]))
        return f"{total:.1f} s: {', '.join(parts)}"
