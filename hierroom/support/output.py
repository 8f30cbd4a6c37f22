"""Output that may lose its reader, and lines about the progress of slow work, with the time left."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from threading import Lock
from typing import Any, TextIO, TypeVar

from hierroom.support.errors import one_line


class LastingStream:
    """A text stream to which writing never fails; text is lost if it cannot be written, or if the stream is None."""

    def __init__(self, stream: TextIO | None) -> None:
        self.stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)

    def write(self, text: str) -> int:
        """Write a text, with escapes for characters that the stream's encoding lacks."""
        if self.stream is not None:
            try:
                self.stream.write(text)
            except UnicodeEncodeError:
                encoding = self.stream.encoding or "ascii"
                self.write(text.encode(encoding, "backslashreplace").decode(encoding))
            except (OSError, ValueError):  # ValueError: the stream is closed
                self._lose()
        return len(text)

    def flush(self) -> None:
        """Write the buffered text."""
        if self.stream is not None:
            try:
                self.stream.flush()
            except (OSError, ValueError):
                self._lose()

    def _lose(self) -> None:
        """Redirect the stream to the null device, so that Python can flush buffered text at exit."""
        with suppress(OSError, ValueError, AttributeError):
            number = self.stream.fileno() if self.stream is not None else -1
            if number in (1, 2):  # standard output or error
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, number)
                os.close(nowhere)


class _LastingOutput:
    """Replaces the process's standard output and error while at least one thread is in the context."""

    def __init__(self) -> None:
        self._lock, self._n_users = Lock(), 0
        self._streams: dict[str, LastingStream] = {}

    @contextmanager
    def __call__(self) -> Iterator[None]:
        """Make writing to standard output and standard error never fail in this context."""
        with self._lock:
            self._n_users += 1
            if self._n_users == 1:
                self._streams = {name: LastingStream(getattr(sys, name)) for name in ("stdout", "stderr")}
                for name, stream in self._streams.items():
                    setattr(sys, name, stream)
        try:
            yield
        finally:
            with self._lock:
                self._n_users -= 1
                if not self._n_users:
                    for name, stream in self._streams.items():
                        setattr(sys, name, stream.stream)


lasting_output = _LastingOutput()


_quiet: ContextVar[bool] = ContextVar("quiet", default=False)


@contextmanager
def silence() -> Iterator[None]:
    """Make runs print nothing in this context and thread; see `is_quiet`."""
    from hierroom.support.kernel import compile_clock  # imports Numba

    before, clock = _quiet.set(True), compile_clock()
    may_speak, clock.may_speak = clock.may_speak, False
    try:
        yield
    finally:
        clock.may_speak = may_speak
        _quiet.reset(before)


def is_quiet() -> bool:
    """Return whether a run in this thread prints nothing."""
    return _quiet.get()


def warn(line: str) -> None:
    """Print a warning on standard error, if it is open, unless the run prints nothing."""
    if is_quiet():
        return
    print(one_line(f"warning: {line}"), file=LastingStream(sys.stderr))


T = TypeVar("T")
FIRST_SECONDS, NEXT_SECONDS = 2.0, 10.0
"""Seconds until the first line, and between later lines."""


@contextmanager
def said_when_slow(
    work: str | Callable[[], str], share: Callable[[], float] = lambda: 0.0
) -> Iterator[Callable[[float], None]]:
    """Write lines about the work in this context to standard error, if it takes longer than two seconds.

    No line repeats a share of the work, because whoever asks for episodes one by one may keep the work waiting.

    Args:
        work: the work in words, such as ``playing 100 episodes``, or a function that returns them.
        share: returns the share of the work that is done, 0 to 1. Or call the function that this context gives with it.
    """
    done, began, stream, shares = threading.Event(), time.perf_counter(), LastingStream(sys.stderr), [0.0]

    def say() -> None:
        wait, before = FIRST_SECONDS, 0.0
        while not done.wait(wait):
            now, seconds = max(shares[0], share()), time.perf_counter() - began
            if now and now == before:
                continue
            words, before = work if isinstance(work, str) else work(), now
            ready = f"{now:.0%} done, about {duration(seconds * (1 - now) / now)} left" if now else duration(seconds)
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


def duration(seconds: float) -> str:
    """Return a number of seconds in words."""
    for unit, size in (("hours", 3600), ("minutes", 60)):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {unit}"
    return "1 second" if seconds < 1.5 else f"{seconds:.0f} seconds"
