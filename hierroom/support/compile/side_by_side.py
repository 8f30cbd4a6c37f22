"""Compilation in two processes at the same time, as Numba compiles one function at a time in each."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from numba.core import config

from hierroom.support.compile.clock import ADVICE, compile_clock
from hierroom.support.compile.kernel_folder import PACKAGE, kernel_folder
from hierroom.support.slow import said_when_slow


@contextmanager
def side_by_side(statement: str) -> Iterator[None]:
    """Run a Python statement in another process during this context, wait for it at the end, and report progress.

    The statement compiles kernels that this process calls later; any others are compiled when they are called. No other
    process is started if there is only one core, or no folder where both processes can keep kernels.
    """
    clock, child, started = compile_clock(), None, time.perf_counter()
    if _can_share():
        code = f"import sys; sys.path.insert(0, {str(PACKAGE.parent)!r}); {statement}"
        nowhere = subprocess.DEVNULL
        child = subprocess.Popen([sys.executable, "-c", code], stdin=nowhere, stdout=nowhere, stderr=nowhere)

    def progress() -> str:
        so_far = f"{n_compiled()} so far, in {time.perf_counter() - started:.0f} s"
        return f"compiling kernels ({so_far}), {ADVICE}"

    try:
        with clock.quiet(), said_when_slow(progress):
            yield
            if child is not None:
                waiting = time.perf_counter()
                child.wait()
                clock.add(time.perf_counter() - waiting)
    finally:
        if child is not None:
            child.kill()  # has no effect if it has ended
            child.wait()


def n_compiled() -> int:
    """Return the number of kernels on disk, counting each signature of a kernel."""
    return len([*Path(kernel_folder() or os.devnull).rglob("*.nbc")])


def _can_share() -> bool:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    is_first = multiprocessing.parent_process() is None  # siblings of a worker use the other cores
    is_compiled = not config.DISABLE_JIT  # pyright: ignore[reportAttributeAccessIssue] - Numba sets it at run time
    return cores > 1 and is_first and is_compiled and kernel_folder() is not None
