"""A clock of Numba's compilation, which does not count as training, and a notice that it compiles."""

from __future__ import annotations

import multiprocessing
import sys
from functools import cache
from typing import Any

from numba.core import event

COMPILE_EVENT = "numba:compile"
"""Numba's event for the compilation of one function that is not on disk."""
NOTICE = "compiling kernels, once, for up to a minute; python -m hierroom compile does it ahead"


def compiling(event: event.Event) -> Any:
    """Return the kernel that such an event announces."""
    assert event.data is not None
    return event.data["dispatcher"]


class CompileClock(event.TimingListener):
    """Adds up the time that this process compiles."""

    is_notice_due = True  # whether a user on a terminal does not know yet why nothing seems to happen

    @property
    def seconds(self) -> float:
        """The time so far."""
        return self.duration if self.done else 0.0

    def on_start(self, event: event.Event) -> None:
        """Start the clock; print the notice for the first kernel."""
        super().on_start(event)
        if self.is_notice_due and compiling(event).py_func.__module__.startswith("hierroom."):
            self.is_notice_due = False
            # Where workers compile, their parent does, too.
            if sys.stderr is not None and sys.stderr.isatty() and multiprocessing.parent_process() is None:
                print(NOTICE, file=sys.stderr)


@cache
def compile_clock() -> CompileClock:
    """Return the clock of this process, which runs from the first call on."""
    clock = CompileClock()
    event.register(COMPILE_EVENT, clock)
    return clock
