"""Stopping training between two updates on request."""

from __future__ import annotations

import signal
import threading
from types import FrameType


class Interrupt:
    """A context in which a signal to stop only sets `is_requested`, so that training can stop in a consistent state.

    The signals are Ctrl-C, SIGTERM and SIGHUP. A second Ctrl-C raises KeyboardInterrupt; the others do not, because
    they may be sent more than once. Outside the main thread the context does nothing. ``hears_ctrl_c`` is False where
    the parent process hears Ctrl-C and sends SIGTERM.
    """

    def __init__(self, *, hears_ctrl_c: bool = True) -> None:
        self.is_requested = False
        self._hears_ctrl_c = hears_ctrl_c

    def __enter__(self) -> Interrupt:
        numbers = [signal.SIGTERM]
        if self._hears_ctrl_c:
            numbers.append(signal.SIGINT)
        if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
            numbers.append(signal.SIGHUP)
        is_main = threading.current_thread() is threading.main_thread()
        self._before = {number: signal.signal(number, self._note) for number in numbers if is_main}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.is_requested and number == signal.SIGINT:
            raise KeyboardInterrupt
        self.is_requested = True
