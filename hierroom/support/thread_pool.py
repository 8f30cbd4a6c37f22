"""Threads that survive a fork and a copy."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any


class ThreadPool:
    """A pool whose threads start when there is something to do, anew in each process and in each copy.

    Threads do not survive a fork: in the new process, the old pool would wait for them for ever. Nor can they be copied
    or pickled.

    Args:
        threads: how many there are at most, at least 1.
    """

    def __init__(self, threads: int) -> None:
        self._threads = threads
        self._process, self._executor = 0, None

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future:
        """Let a thread call a function; returns the future of its result."""
        executor, process = self._executor, os.getpid()
        if executor is None or self._process != process:
            executor = self._executor = ThreadPoolExecutor(self._threads)
            self._process = process
        return executor.submit(function, *arguments)

    def __reduce__(self) -> tuple[type[ThreadPool], tuple[int]]:
        """A copy, in this process or another, starts threads of its own."""
        return ThreadPool, (self._threads,)
