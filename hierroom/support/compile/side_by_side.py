"""Compilation in two processes side by side, as Numba compiles one function at a time in each."""

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
    """Let another process run a Python statement meanwhile, wait for it at the end, and say how far both are.

    It compiles kernels that are called here later; what it does not compile is compiled when it is called. Where there
    is one core alone, or no folder that both processes keep kernels in, there is no other process.
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
            child.kill()  # nothing happens to one that has ended
            child.wait()


def n_compiled() -> int:
    """Return the number of kernels on disk, each counted once for each signature."""
    return len([*Path(kernel_folder() or os.devnull).rglob("*.nbc")])


def _can_share() -> bool:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    is_first = multiprocessing.parent_process() is None  # workers have siblings that compute
    is_compiled = not config.DISABLE_JIT  # pyright: ignore[reportAttributeAccessIssue] - Numba sets it at run time
    return cores > 1 and is_first and is_compiled and kernel_folder() is not None
