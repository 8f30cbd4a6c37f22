"""A process that holds some environments of a task."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from multiprocessing import Pipe, Process
from multiprocessing.connection import Connection, wait
from multiprocessing.util import register_after_fork
from signal import Signals
from typing import Any, cast

from gymnasium.vector.utils import CloudpickleWrapper

from hierroom.support.errors import InputError, RunError, in_one_line
from hierroom.support.interrupt import STOPS, awaited, blocked, leave_stops_to_parent
from hierroom.worlds.task.local_envs import LocalEnvs
from hierroom.worlds.task.parts import TaskParts

ENDING_SECONDS = 5.0
"""Time for a worker to close its environments; then it is killed."""


class Worker:
    """A process with environments ``envs`` of a task; it answers calls of their methods one after the other."""

    def __init__(self, task: TaskParts, envs: range, number: int, count: int, render_mode: str | None) -> None:
        self._task = task.name
        which = f"environments {envs[0]} to {envs[-1]}" if len(envs) > 1 else f"environment {envs[0]}"
        self._label = f"worker {number} of {count} ({which})"
        self._connection, theirs = Pipe()
        is_alive, self._is_alive = Pipe(duplex=False)  # it closes when this process ends
        for ours in (self._connection, self._is_alive):
            register_after_fork(ours, Connection.close)  # so that no other worker holds them open
        made = partial(LocalEnvs, task, len(envs), render_mode, task.trial.mask)
        make = CloudpickleWrapper(cast(Any, made))  # lambdas pickle, too
        self._process = Process(target=_work, args=(theirs, is_alive, self._label, make), daemon=True)
        with blocked(STOPS):
            self._process.start()
        theirs.close()  # so that our end closes when the process ends
        is_alive.close()
        self._call, self._fault = "make", ""

    def call(self, method: str, *arguments: Any) -> None:
        """Begin a call of a method; `answer` waits for it."""
        if self._call and not self._fault:
            self._fault = f"was interrupted in {self._call}; make the environments anew"
        if not self._fault:
            self._call = method
            with suppress(OSError):  # `answer` notices that the process has ended
                self._connection.send((method, *arguments))

    def answer(self) -> Any:
        """Return the result of the call; an error of the user's code, and a process that ended, give one line."""
        if not self._fault:
            try:
                with awaited(f"{self._call} of {self._task} in {self._label}"):
                    while not self._connection.poll(1):  # no longer, as a signal may come just before a wait begins
                        if self._process.exitcode is not None and not self._connection.poll():
                            raise EOFError  # a process that it started may hold its end of the pipe open
                    error, result = self._connection.recv()
            except (EOFError, OSError):
                self._fault = f"has ended in {self._call}{self._reason()}"
        if self._fault:
            raise RunError(f"{self._label} of {self._task} {self._fault}")
        self._call = ""
        if error:
            raise InputError(f"{error}, in {self._label}")
        return result

    def _reason(self) -> str:
        self._process.join(ENDING_SECONDS)
        code = self._process.exitcode
        if code is None or code >= 0:
            return "" if code is None else f" with exit code {code}"
        killed = f" by signal {Signals(-code).name}"
        return f"{killed}, perhaps for lack of memory" if killed.endswith("KILL") else killed

    @staticmethod
    def end(workers: list[Worker]) -> None:
        """Let workers close their environments and end; kill those that do not, or are still in a call."""
        try:
            for worker in workers:
                with suppress(OSError):
                    worker._connection.send(None)
            last = time.monotonic() + ENDING_SECONDS
            for worker in workers:
                if worker._call:
                    continue
                worker._process.join(max(0.0, last - time.monotonic()))
                if worker._process.exitcode is None:
                    print(
                        f"warning: close of {worker._task} did not end, so {worker._label} is killed", file=sys.stderr
                    )
        finally:
            for worker in workers:
                worker._process.kill()
                worker._process.join()
                worker._connection.close()
                worker._is_alive.close()
                worker._fault = worker._fault or "was closed"


def _work(connection: Connection, is_alive: Connection, label: str, make: Callable[[], LocalEnvs]) -> None:
    """Answer calls until the parent says None or ends; then close the environments."""
    leave_stops_to_parent()
    for name in ("stdout", "stderr"):  # a fork inherits those of a progress bar, with the locks of its thread
        setattr(sys, name, getattr(getattr(sys, name), "rich_proxied_file", getattr(sys, name)))
    threading.Thread(target=_end_with_parent, args=(is_alive,), daemon=True).start()
    envs, call = None, ("make",)
    with suppress(EOFError, OSError):
        while call is not None:
            try:
                if envs is None:
                    envs, result = make(), None
                else:
                    result = getattr(envs, call[0])(*call[1:])
                connection.send(("", result))
            except (InputError, KeyboardInterrupt) as error:  # Ctrl-C is left to the parent, so user code raised it
                connection.send((in_one_line(error), None))
            except Exception as error:  # user code may return what cannot be sent
                connection.send((f"the result of {call[0]} cannot be sent: {in_one_line(error)}", None))
            call = connection.recv()
    if envs is not None and (error := envs.close()):
        print(f"warning: {error}, in {label}\n", end="", file=sys.stderr)  # in one piece, as others may write too


def _end_with_parent(is_alive: Connection) -> None:
    """End this process if its parent has ended, although an environment never ends its step."""
    wait([is_alive])
    time.sleep(ENDING_SECONDS)
    os._exit(1)
