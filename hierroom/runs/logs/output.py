"""Output that may have no reader: training goes on after a terminal was closed or a reader has gone."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from typing import Any, TextIO

from hierroom.support.errors import one_line


class LastingStream:
    """A text stream to which writing never fails; text is lost if it cannot be written, or if the stream is None."""

    def __init__(self, stream: TextIO | None) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write, with escapes for the characters that the stream's encoding lacks."""
        if self._stream is not None:
            try:
                self._stream.write(text)
            except UnicodeEncodeError:
                encoding = self._stream.encoding or "ascii"
                self.write(text.encode(encoding, "backslashreplace").decode(encoding))
            except (OSError, ValueError):  # ValueError: it was closed
                self._lose()
        return len(text)

    def flush(self) -> None:
        """Write what is still in memory."""
        if self._stream is not None:
            try:
                self._stream.flush()
            except (OSError, ValueError):
                self._lose()

    def _lose(self) -> None:
        """Lead the stream nowhere, so that Python does not fail at exit with what it still has in memory."""
        with suppress(OSError, ValueError, AttributeError):
            number = self._stream.fileno() if self._stream is not None else -1
            if number in (1, 2):  # the process's own
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, number)
                os.close(nowhere)


@contextmanager
def lasting_output() -> Iterator[None]:
    """A context in which writing to standard output and standard error never fails."""
    with redirect_stdout(LastingStream(sys.stdout)), redirect_stderr(LastingStream(sys.stderr)):  # pyright: ignore[reportArgumentType]
        yield


def warn(line: str) -> None:
    """Print a warning on standard error, if anybody can read it."""
    print(one_line(f"warning: {line}"), file=LastingStream(sys.stderr))
