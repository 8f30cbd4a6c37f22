"""Threads that survive a fork and a copy."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any


class ThreadPool:
    """A pool of threads, which start at the first task, anew in each process and copy: no thread survives a fork."""

    def __init__(self, threads: int) -> None:
        self._threads = threads
        self._process, self._executor = 0, None

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future:
        """Let a thread call a function; return the future of its result."""
        if self._executor is None or self._process != os.getpid():
            self._executor, self._process = ThreadPoolExecutor(self._threads), os.getpid()  # no thread sees a dead one
        return self._executor.submit(function, *arguments)

    def __reduce__(self) -> tuple[type[ThreadPool], tuple[int]]:
        """Give each copy its own threads."""
        return ThreadPool, (self._threads,)
