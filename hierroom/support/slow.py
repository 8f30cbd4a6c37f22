"""Lines about the progress of slow work."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

FIRST_SECONDS, NEXT_SECONDS = 2.0, 10.0
"""Seconds until the first line, and between later lines."""


@contextmanager
def said_when_slow(progress: Callable[[], str]) -> Iterator[None]:
    """Write the progress of the work in this context to standard error, if it takes longer than two seconds."""
    done = threading.Event()

    def say() -> None:
        wait = FIRST_SECONDS
        while not done.wait(wait):
            print(progress(), file=sys.stderr, flush=True)
            wait = NEXT_SECONDS

    threading.Thread(target=say, daemon=True).start()
    try:
        yield
    finally:
        done.set()
