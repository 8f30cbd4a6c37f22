"""Stop training between two updates when a signal asks for it."""

from __future__ import annotations

import signal
import threading
from types import FrameType

_UNLESS_TAKEN = ("SIGHUP", "SIGUSR1", "SIGUSR2", "SIGXCPU")
"""Signals of terminals and schedulers; they are left alone if the process ignores (as under nohup) or handles them."""


class Interrupt:
    """A context in which a signal to stop only sets `is_requested`, so that training can stop in a consistent state.

    The signals are Ctrl-C and SIGTERM, and also SIGHUP, SIGUSR1, SIGUSR2 and SIGXCPU if nothing else handles them. A
    second Ctrl-C raises KeyboardInterrupt; the others do not, because they may be sent more than once. Outside the main
    thread the context does nothing. ``hears_ctrl_c`` is False if the parent process answers Ctrl-C with SIGTERM.
    """

    def __init__(self, *, hears_ctrl_c: bool = True) -> None:
        self.is_requested = self._has_heard_ctrl_c = False
        self._hears_ctrl_c = hears_ctrl_c

    def __enter__(self) -> Interrupt:
        numbers = [signal.SIGTERM, *([signal.SIGINT] if self._hears_ctrl_c else ())]
        known = [getattr(signal, name) for name in _UNLESS_TAKEN if hasattr(signal, name)]
        numbers += [number for number in known if signal.getsignal(number) == signal.SIG_DFL]
        is_main = threading.current_thread() is threading.main_thread()
        self._before = {number: signal.signal(number, self._note) for number in numbers if is_main}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if number == signal.SIGINT:
            if self._has_heard_ctrl_c:
                raise KeyboardInterrupt
            self._has_heard_ctrl_c = True
        self.is_requested = True
