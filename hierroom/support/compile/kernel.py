"""Numba's ``njit`` as every kernel of the package uses it: it always finds a place for compiled code, and says so."""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import sys
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import config, event

from hierroom.support.compile.clock import COMPILE_EVENT, compiling
from hierroom.support.compile.folder import private_folder

PACKAGE = Path(__file__).parents[2]
CONSTANTS = ("constants.py", "ids.py")
"""Files of numbers that kernels use."""
KERNELS: list[Any] = []
"""All kernels whose compiled code is kept on disk, in the order in which they were defined."""
NOTICE_TEXT = "compiling kernels, once, for up to a minute; python -m hierroom compile does it ahead"


def njit(*, cache: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Numba's ``njit``, which defines the kernel also where neither the package nor the home folder can be written.

    Numba keeps compiled code in ``NUMBA_CACHE_DIR``, in ``__pycache__`` or in the user's cache folder, and raises
    where it may write to none of them. Then `private_folder` takes their place.

    Args:
        cache: whether compiled code is kept on disk.
        **options: any others of Numba's.

    Returns:
        a decorator, which makes a function a kernel.
    """

    def define(function: Callable[..., Any]) -> Any:
        if not cache:
            return numba.njit(**options)(function)
        kernel: Any
        try:
            kernel = numba.njit(cache=True, **options)(function)
        except RuntimeError as error:
            if "no locator available" not in str(error):
                raise
            kernel = numba.njit(cache=_move_cache(), **options)(function)
        if hasattr(kernel, "stats"):  # not where NUMBA_DISABLE_JIT leaves it the function
            file = kernel._cache._cache_file
            file._source_stamp = file._source_stamp, digest_of_kernels(PACKAGE)
        KERNELS.append(kernel)
        return kernel

    return define


def compiled(kernel: Any, *arrays: Any) -> Any:
    """Compile a kernel for arguments of the same types as ``arrays``; the caller must only pass such arguments.

    Calling a kernel by its name makes Numba look up the types of the arguments in each call. With six arrays, four of
    them records, that takes several times as long as the step of one environment.
    """
    return kernel.compile(tuple(numba.typeof(array) for array in arrays)) if hasattr(kernel, "compile") else kernel


@cache
def digest_of_kernels(folder: Path) -> str:
    """SHA-256 of all files in a folder that define kernels, or numbers that are compiled into them.

    Numba would keep compiled code as long as the kernel's own file is the same, but kernels call those of other files.
    """
    contents = {path: path.read_bytes() for path in sorted(folder.rglob("*.py"))}
    of_kernels = (content for path, content in contents.items() if path.name in CONSTANTS or b"njit(" in content)
    return hashlib.sha256(b"".join(of_kernels)).hexdigest()


def _move_cache() -> bool:
    """Keep compiled code in a private folder from now on, in this process and its children; returns whether it can."""
    folder = _told_folder()
    if folder is not None:
        os.environ["NUMBA_CACHE_DIR"] = folder
        config.reload_config()  # pyright: ignore[reportAttributeAccessIssue] - Numba sets it at run time
    return folder is not None


@cache
def _told_folder() -> str | None:
    """A private folder, with the process's one warning of it."""
    folder = private_folder()
    kept = (
        f"is kept in {folder}" if folder else "is lost at the end of each process, which begins by compiling it again"
    )
    warnings.warn(
        f"neither the package nor the user's cache folder can be written: the compiled code of its kernels {kept}; "
        "set NUMBA_CACHE_DIR to a folder of your own to keep it elsewhere",
        RuntimeWarning,
        stacklevel=2,
    )
    return folder


class CompileNotice(event.Listener):
    """Tells a user on a terminal, once, why nothing seems to happen: kernels are compiled at their first use."""

    def __init__(self) -> None:
        self.is_due = True

    def on_start(self, event: event.Event) -> None:
        """Compilation of a function begins; those of other packages are theirs to speak of."""
        if self.is_due and compiling(event).py_func.__module__.startswith("hierroom."):
            self.is_due = False
            # Where workers compile, their parent does, too.
            if sys.stderr is not None and sys.stderr.isatty() and multiprocessing.parent_process() is None:
                print(NOTICE_TEXT, file=sys.stderr)

    def on_end(self, event: event.Event) -> None:
        """Compilation of a function ends."""


NOTICE = CompileNotice()
event.register(COMPILE_EVENT, NOTICE)
