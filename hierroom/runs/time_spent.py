"""The wall-clock time of a session, by activity."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from hierroom.support.compile_clock import compile_clock


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
