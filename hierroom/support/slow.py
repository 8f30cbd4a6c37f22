"""Lines about the progress of slow work, with the time left."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")
FIRST_SECONDS, NEXT_SECONDS = 2.0, 10.0
"""Seconds until the first line, and between later lines."""


@contextmanager
def said_when_slow(
    work: str | Callable[[], str], share: Callable[[], float] = lambda: 0.0
) -> Iterator[Callable[[float], None]]:
    """Write lines about the work in this context to standard error, if it takes longer than two seconds.

    Args:
        work: the work in words, such as ``playing 100 episodes``, or a function that returns them.
        share: returns the share of the work that is done, 0 to 1. Or call the function that this context gives with it.
    """
    from hierroom.support.output import is_quiet  # imports Numba

    done, began, stream, shares = threading.Event(), time.perf_counter(), sys.stderr, [0.0]

    def say() -> None:
        wait = FIRST_SECONDS
        while not done.wait(wait):
            words = work if isinstance(work, str) else work()
            now, seconds = max(shares[0], share()), time.perf_counter() - began
            ready = f"{now:.0%} done, about {_duration(seconds * (1 - now) / now)} left" if now else _duration(seconds)
            print(f"{words}: {ready}", file=stream, flush=True)
            wait = NEXT_SECONDS

    if not is_quiet():
        threading.Thread(target=say, daemon=True).start()
    try:
        yield lambda now: shares.__setitem__(0, now)
    finally:
        done.set()


@contextmanager
def told_or_said(progress: Callable[[int], object] | None, work: str, total: int) -> Iterator[Callable[[int], object]]:
    """Give the user's function, to call with the number done of a total; without one, a function that writes lines."""
    if progress is not None:
        yield progress
        return
    with said_when_slow(work) as tell:
        yield lambda done: tell(done / total)


def said_in_turn(work: str, items: Sequence[T]) -> Iterator[T]:
    """Yield the items, and write lines about the work on them as `said_when_slow` does."""
    with said_when_slow(work) as tell:
        for n, item in enumerate(items):
            tell(n / len(items))
            yield item


def _duration(seconds: float) -> str:
    for unit, size in (("hours", 3600), ("minutes", 60)):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds:.0f} seconds"
