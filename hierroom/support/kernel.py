"""Numba's ``njit`` as every kernel of the package uses it: compiled code is kept on disk if a folder can be written."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from typing import Any

import numba
import numpy as np
from numba.core import config, types

from hierroom.support.compile_clock import compile_clock
from hierroom.support.errors import warn_once
from hierroom.support.kernel_folder import kernel_folder

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
