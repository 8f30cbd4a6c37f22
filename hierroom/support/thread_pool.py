"""Threads that also work after a fork and in a copy, and environments divided among threads."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from hierroom.support.schema import Whole

MIN_ENVS_PER_THREAD = 1024
"""With fewer environments per thread, starting another thread to step them costs more than it saves."""


class ThreadPool:
    """A pool of ``threads``. They start at the first task in each process and copy, as no thread survives a fork."""

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self._process, self._executor = 0, None

    def each(self, function: Callable[..., Any], *arguments: Iterable[Any]) -> list[Any]:
        """Call a function for the first of all arguments, for the second and so on; return the results of all calls.

        The caller itself makes a single call, or all if there is one thread.
        """
        calls = [*zip(*arguments, strict=True)]
        if self.threads == 1 or len(calls) == 1:
            return [function(*call) for call in calls]
        if self._executor is None or self._process != os.getpid():
            self._executor, self._process = ThreadPoolExecutor(self.threads), os.getpid()  # no thread sees a dead one
        futures = [self._executor.submit(function, *call) for call in calls]
        return [future.result() for future in futures]

    def __reduce__(self) -> tuple[type[ThreadPool], tuple[int]]:
        """Give each copy its own threads."""
        return ThreadPool, (self.threads,)


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
        """Let each thread work on its slice, and wait for all."""
        self._pool.each(work, self._slices)
