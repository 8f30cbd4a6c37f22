"""Matrix products inside compiled functions: `tile_kernels` where they work on this machine, else `blas_kernels`.

The tiles are written in LLVM's own language, which another version of llvmlite or another processor may refuse. So they
are tried whenever this module is imported, before anything is compiled that calls them.
"""

from __future__ import annotations

import warnings
from types import ModuleType

import numpy as np
from numba.core import config

from hierroom.learners.fused import blas_kernels


def works(kernels: ModuleType) -> bool:
    """Whether the products of a module come out right, for sizes with whole tiles and with remainders.

    Args:
        kernels: `tile_kernels` or a module with the same functions.
    """
    random = np.random.default_rng(0)
    a, b = random.random((6, 70), np.float32), random.random((70, 150), np.float32)
    expected = 1 + a @ b
    product, transposed = np.ones_like(expected), np.ones_like(expected)
    kernels.add_product(a, kernels.pack(b.T.copy().T), product)
    kernels.add_transposed_product(a.T.copy(), b, transposed)
    return np.allclose(product, expected, rtol=1e-4) and np.allclose(transposed, expected, rtol=1e-4)


def _working_kernels() -> ModuleType:
    if config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue] - LLVM cannot run as plain Python
        return blas_kernels
    try:
        from hierroom.learners.fused import tile_kernels

        if works(tile_kernels):
            return tile_kernels
        reason = "their results are wrong"
    except Exception as error:  # whatever llvmlite, Numba or LLVM may have against them
        reason = " ".join([type(error).__name__, *str(error).split("\n")[:1]])
    warnings.warn(
        f"the learner's own matrix products do not work here and np.dot takes their place, which is slower ({reason})",
        RuntimeWarning,
        stacklevel=2,
    )
    return blas_kernels


chosen = _working_kernels()
pack, add_product, add_transposed_product = chosen.pack, chosen.add_product, chosen.add_transposed_product
