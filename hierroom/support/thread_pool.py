"""Threads that also work after a fork and in a copy, and environments divided among threads."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from hierroom.support.schema import Whole

MIN_ENVS_PER_THREAD = 1024
"""With fewer environments per thread, starting another thread to step them costs more than it saves."""


class ThreadPool:
    """A pool of threads. They start at the first task in each process and copy, as no thread survives a fork."""

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


class Shares:
    """N environments in slices, one for each thread; small N use fewer threads, see `MIN_ENVS_PER_THREAD`.

    Attributes:
        is_one: whether there is only one slice, so that no other thread works.
    """

    def __init__(self, num_envs: int, threads: int) -> None:
        Whole(1, 2**31 - 1).check(threads, "threads")
        n_shares = max(1, min(threads, num_envs // MIN_ENVS_PER_THREAD))
        self._slices = [slice(a, b) for a, b in pairwise(np.linspace(0, num_envs, n_shares + 1).astype(int).tolist())]
        self.is_one, self._pool = n_shares == 1, ThreadPool(n_shares)

    def each(self, work: Callable[[slice], object]) -> None:
        """Let each thread work on its slice, and wait for all; if there is one slice, the caller works on it."""
        if self.is_one:
            work(self._slices[0])
            return
        for future in [self._pool.submit(work, share) for share in self._slices]:
            future.result()
