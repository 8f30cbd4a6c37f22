"""Stopping between two updates, when asked to."""

from __future__ import annotations

import signal
from types import FrameType


class Interrupt:
    """Within it, Ctrl-C (or SIGTERM) is only noted, so that work ends where its state is whole; a second one stops.

    Attributes:
        is_requested: whether it was noted.
    """

    def __init__(self) -> None:
        self.is_requested = False

    def __enter__(self) -> Interrupt:
        self._before = {number: signal.signal(number, self._note) for number in (signal.SIGINT, signal.SIGTERM)}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.is_requested:
            raise KeyboardInterrupt
        self.is_requested = True
