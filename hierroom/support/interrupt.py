"""Signals that ask to stop: training notes them and stops between two updates; a worker process leaves them to it."""

from __future__ import annotations

import queue
import signal
import threading
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import ClassVar

_UNLESS_TAKEN = ("SIGHUP", "SIGUSR1", "SIGUSR2", "SIGXCPU")
"""Signals of terminals and schedulers; they are left alone if the process ignores (as under nohup) or handles them."""
STOPS = [getattr(signal, name) for name in ("SIGTERM", "SIGINT", *_UNLESS_TAKEN) if hasattr(signal, name)]
"""All signals that ask to stop."""
SECONDS = 1.0
"""Seconds after a signal until a line says what has to end first."""


class Interrupt:
    """A context in which a signal to stop only sets `is_requested`, so that training can stop in a consistent state.

    The signals are Ctrl-C and SIGTERM, and also SIGHUP, SIGUSR1, SIGUSR2 and SIGXCPU if nothing else handles them. A
    second Ctrl-C raises KeyboardInterrupt; the others do not, because they may be sent more than once. Outside the main
    thread the context does nothing.

    Args:
        hears_ctrl_c: False if the parent process answers Ctrl-C with SIGTERM.
        say: gets a line that names what is `awaited`, if the context has not ended a second after a signal.
    """

    def __init__(self, *, hears_ctrl_c: bool = True, say: Callable[[str], object] | None = None) -> None:
        self.is_requested = self._has_heard_ctrl_c = False
        self._hears_ctrl_c, self._say = hears_ctrl_c, say
        self._events = queue.SimpleQueue[int | None]()  # a signal handler may put into no other queue

    def __enter__(self) -> Interrupt:
        numbers = [signal.SIGTERM, *([signal.SIGINT] if self._hears_ctrl_c else ())]
        numbers += [one for one in STOPS if one.name in _UNLESS_TAKEN and signal.getsignal(one) == signal.SIG_DFL]
        is_main = threading.current_thread() is threading.main_thread()
        if is_main and self._say is not None:
            watcher = threading.Thread(target=self._explain, args=(self._say, threading.get_ident()), daemon=True)
            with blocked(STOPS):  # they wake the main thread
                watcher.start()
        self._before = {number: signal.signal(number, self._note) for number in numbers if is_main}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._events.put(None)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if number == signal.SIGINT:
            if self._has_heard_ctrl_c:
                raise KeyboardInterrupt
            self._has_heard_ctrl_c = True
        self.is_requested = True
        self._events.put(number)

    def _explain(self, say: Callable[[str], object], thread: int) -> None:
        event = self._events.get()
        try:
            while event is not None:
                event = self._events.get(timeout=SECONDS)
        except queue.Empty:
            again = "; press Ctrl-C again to leave without saving" * self._has_heard_ctrl_c
            say(f"waiting for {', now for '.join(awaited.names.get(thread) or ('the end',))}{again}")


class awaited:
    """A context for work that may last; `Interrupt` says its name, if a signal asks to stop meanwhile.

    Attributes:
        names: what each thread does, by its identifier: names from the outermost to the innermost.
    """

    __slots__ = ("_name", "_outer")
    names: ClassVar[dict[int, tuple[str, ...]]] = {}

    def __init__(self, name: str) -> None:
        self._name = name

    def __enter__(self) -> None:
        thread = threading.get_ident()
        self._outer = self.names.get(thread, ())
        self.names[thread] = (*self._outer, self._name)

    def __exit__(self, *_: object) -> None:
        self.names[threading.get_ident()] = self._outer


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
