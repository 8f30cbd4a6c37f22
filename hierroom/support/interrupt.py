"""Signals that ask to stop: training notes them and stops between two updates; a worker process leaves them to it."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from types import FrameType

_UNLESS_TAKEN = ("SIGHUP", "SIGUSR1", "SIGUSR2", "SIGXCPU")
"""Signals of terminals and schedulers; they are left alone if the process ignores (as under nohup) or handles them."""
STOPS = [getattr(signal, name) for name in ("SIGTERM", "SIGINT", *_UNLESS_TAKEN) if hasattr(signal, name)]
"""All signals that ask to stop."""
SECONDS = 1.0
"""Seconds after a signal until a line says that something has to end first."""


class Interrupt:
    """A context in which a signal to stop only sets `is_requested`, so that training can stop in a consistent state.

    The signals are Ctrl-C and SIGTERM, and also SIGHUP, SIGUSR1, SIGUSR2 and SIGXCPU if nothing else handles them. A
    second Ctrl-C raises KeyboardInterrupt; the others do not, because they may be sent more than once. Outside the main
    thread the context does nothing.

    Args:
        hears_ctrl_c: False if the parent process answers Ctrl-C with SIGTERM.
        say: gets a line if the context has not ended a second after a signal.
    """

    def __init__(self, *, hears_ctrl_c: bool = True, say: Callable[[str], object] | None = None) -> None:
        self.is_requested = self._has_heard_ctrl_c = False
        self._hears_ctrl_c, self._say = hears_ctrl_c, say
        self._timer: threading.Timer | None = None

    def __enter__(self) -> Interrupt:
        numbers = [signal.SIGTERM, *([signal.SIGINT] if self._hears_ctrl_c else ())]
        numbers += [number for number in STOPS if number.name in _UNLESS_TAKEN and _is_default(number)]
        is_main = threading.current_thread() is threading.main_thread()
        self._before = {number: signal.signal(number, self._note) for number in numbers if is_main}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        if self._timer is not None:
            self._timer.cancel()

    def _note(self, number: int, frame: FrameType | None) -> None:
        if number == signal.SIGINT:
            if self._has_heard_ctrl_c:
                raise KeyboardInterrupt
            self._has_heard_ctrl_c = True
        self.is_requested = True
        if self._say is not None and self._timer is None:
            again = "; press Ctrl-C again to leave without saving" * self._has_heard_ctrl_c
            self._timer = threading.Timer(SECONDS, self._say, [f"waiting until it can be saved{again}"])
            self._timer.daemon = True
            with blocked(STOPS):  # they wake the main thread
                self._timer.start()


def _is_default(number: signal.Signals) -> bool:
    return signal.getsignal(number) == signal.SIG_DFL


@contextmanager
def blocked(signals: Collection[signal.Signals]) -> Iterator[None]:
    """Block signals in this context; processes that start in it inherit that, so they are not ended meanwhile."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signals)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def leave_stops_to_parent() -> None:
    """Let signals to stop, which may reach all processes of a terminal or a job, do nothing in this worker process.

    A handler that does nothing is better than to ignore them, because programs that the process starts do not inherit
    it.
    """
    for number in STOPS:
        signal.signal(number, lambda *_: None)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPS)
