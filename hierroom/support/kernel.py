"""Numba's ``njit`` as every kernel of the package uses it: kept on disk if a folder can be written, timed apart."""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import shutil
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core import config, event, types

from hierroom.support.errors import warn_once

PACKAGE = Path(__file__).parents[1]
CONSTANTS = ("constants.py", "ids.py")  # files of numbers that kernels use
_DAY = 24 * 60 * 60


@cache
def kernel_folder() -> str | None:
    """Return the first folder that can be written, in NUMBA_CACHE_DIR, the package or the user's cache; else None."""
    chosen = config.CACHE_DIR  # pyright: ignore[reportAttributeAccessIssue] - Numba sets it at run time
    installation = hashlib.sha256(str(PACKAGE).encode()).hexdigest()[:8]
    name = Path("hierroom", f"{installation}-{digest_of_kernels(PACKAGE)[:16]}")
    cache_home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    for place in (chosen and os.path.abspath(chosen), PACKAGE / "__pycache__", cache_home):
        if not os.path.isabs(place):
            continue
        folder = place / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
        except OSError:
            continue
        for old in {*folder.parent.glob(f"{installation}-*")} - {folder}:  # of earlier source
            with suppress(OSError):  # another process has removed it
                if time.time() - old.stat().st_mtime > _DAY:  # else a process may still write there
                    shutil.rmtree(old)
        return str(folder)
    if multiprocessing.parent_process() is None:
        reason = "neither the package nor the user's cache folder can be written: each process compiles kernels again"
        advice = "set NUMBA_CACHE_DIR to a folder of your own to keep them"
        warnings.warn(f"{reason}; {advice}", RuntimeWarning, stacklevel=2)
    return None


def digest_of_kernels(folder: Path) -> str:
    """Return the SHA-256 of all files in a folder that define kernels, or constants that are compiled into them."""
    contents = {path: path.read_bytes() for path in sorted(folder.rglob("*.py"))}
    of_kernels = (content for path, content in contents.items() if path.name in CONSTANTS or b"njit(" in content)
    return hashlib.sha256(b"".join(of_kernels)).hexdigest()


COMPILE_EVENT = "numba:compile"
"""Numba's event when it compiles a function that is not on disk."""
PATIENCE_SECONDS = 2.0
LINE = "compiling kernels, once, for up to half a minute; python -m hierroom compile does it ahead"


class CompileClock(event.Listener):
    """Adds up the time that this process compiles; if it is long, one line on standard error says so.

    Attributes:
        may_speak: whether the line may still be printed. Worker processes are silent, as their parent compiles, too.
    """

    def __init__(self) -> None:
        self._depth, self._started, self._done = 0, 0.0, 0.0
        self.may_speak = multiprocessing.parent_process() is None

    @property
    def seconds(self) -> float:
        """The seconds of compilation so far."""
        return self._done + (time.perf_counter() - self._started if self._depth else 0.0)

    def on_start(self, event: event.Event) -> None:
        """Start the clock."""
        if self._depth == 0:
            self._started = time.perf_counter()
        self._depth += 1
        assert event.data is not None
        is_ours = event.data["dispatcher"].py_func.__module__.startswith("hierroom.")
        if self.may_speak and is_ours and self.seconds >= PATIENCE_SECONDS and sys.stderr is not None:
            self.may_speak = False
            print(LINE, file=sys.stderr, flush=True)

    def on_end(self, event: event.Event) -> None:
        """Stop the clock."""
        self._depth -= 1
        if self._depth == 0:
            self._done += time.perf_counter() - self._started


@cache
def compile_clock() -> CompileClock:
    """Return the clock of this process, which counts from the first call on."""
    clock = CompileClock()
    event.register(COMPILE_EVENT, clock)
    return clock


KERNELS: list[Any] = []
"""All kernels that are kept on disk, in the order of their definitions."""
compile_clock()  # it also reports compilation on standard error


def njit(*, cache: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorate like Numba's ``njit``, with compiled code in `kernel_folder`; other packages keep their own folders."""
    options |= {"no_cfunc_wrapper": True}  # nobody calls kernels from C

    def define(function: Callable[..., Any]) -> Any:
        if config.DISABLE_JIT and options.get("nogil"):  # pyright: ignore[reportAttributeAccessIssue] - set at run time
            # Random numbers rely on overflow of uint64 scalars, of which NumPy would warn in ordinary Python.
            return np.errstate(over="ignore")(function)
        if not cache or config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue]
            return _with_plain_integers(numba.njit(**options)(function))
        folder, chosen = kernel_folder(), config.CACHE_DIR  # pyright: ignore[reportAttributeAccessIssue]
        config.CACHE_DIR = folder  # pyright: ignore[reportAttributeAccessIssue]
        try:
            kernel: Any = numba.njit(cache=folder is not None, **options)(function)
        finally:
            config.CACHE_DIR = chosen  # pyright: ignore[reportAttributeAccessIssue]
        _spare_the_caller(kernel._cache)
        KERNELS.append(kernel)
        return _with_plain_integers(kernel)

    return define


def _spare_the_caller(cache: Any) -> None:
    """Let a kernel work, compiled anew, if its file is damaged, as after a power failure, or the disk is full."""
    load, save = cache.load_overload, cache.save_overload

    def load_overload(*key: Any) -> Any:
        try:
            return load(*key)
        except Exception:  # damaged pickles raise any error
            with suppress(OSError):
                cache.flush()
            return None

    def save_overload(*entry: Any) -> None:
        try:
            save(*entry)
        except OSError as error:
            warn_once(f"compiled kernels are not kept, and the next process compiles them again: {error.strerror}")

    cache.load_overload, cache.save_overload = load_overload, save_overload


def _with_plain_integers(kernel: Any) -> Any:
    """Make other kernels pass a constant or a narrower signed integer to this one as int64.

    Otherwise Numba would compile a function again for each constant, although LLVM inserts constants by itself.
    """
    if config.DISABLE_JIT or kernel.targetoptions.get("inline"):  # pyright: ignore[reportAttributeAccessIssue]
        return kernel  # a plain function, or one that is inlined
    template = kernel.get_call_template

    def plain(kind: Any) -> Any:
        whole: Any = types.unliteral(kind)
        return types.int64 if isinstance(whole, types.Integer) and getattr(whole, "signed", False) else whole

    def get_call_template(args: Sequence[Any], kws: Mapping[str, Any]) -> Any:
        return template([plain(kind) for kind in args], {name: plain(kind) for name, kind in kws.items()})

    kernel.get_call_template = get_call_template
    return kernel


class Compiled:
    """A kernel for arguments of the same types as ``samples``; the caller must only pass such arguments to `run`.

    Otherwise Numba looks up the types in each call, which takes several times as long as one environment's step.
    """

    def __init__(self, kernel: Any, *samples: Any) -> None:
        self._kernel, self._samples = kernel, samples

    @cached_property
    def run(self) -> Callable[..., Any]:
        """The compiled code of the kernel."""
        has_types = hasattr(self._kernel, "compile")  # it is no plain function
        return self._kernel.compile(tuple(map(numba.typeof, self._samples))) if has_types else self._kernel


@njit(cache=True)
def copy_matrix(source, target):
    """Copy a matrix. ``target[:] = source`` takes Numba seconds, as it compiles an error message with the shapes."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]
