"""Output that may lose its reader: training goes on after a terminal or a pipe is closed."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from threading import Lock
from typing import Any, TextIO

from hierroom.support.compile_clock import compile_clock
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
