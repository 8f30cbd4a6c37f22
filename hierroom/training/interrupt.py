"""Stopping training between two updates on request."""

from __future__ import annotations

import signal
import threading
from types import FrameType


class Interrupt:
    """A context in which the first Ctrl-C or SIGTERM only sets a flag, so that training can stop in a consistent state.

    A second signal raises KeyboardInterrupt. Signals arrive in the main thread alone, so elsewhere none is heard.

    Attributes:
        is_requested: whether a signal has arrived.
    """

    def __init__(self) -> None:
        self.is_requested = False

    def __enter__(self) -> Interrupt:
        is_main = threading.current_thread() is threading.main_thread()
        numbers = (signal.SIGINT, signal.SIGTERM) if is_main else ()
        self._before = {number: signal.signal(number, self._note) for number in numbers}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.is_requested:
            raise KeyboardInterrupt
        self.is_requested = True
