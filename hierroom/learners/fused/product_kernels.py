"""Matrix products inside compiled functions: `tile_kernels` where they work on this machine, else ``np.dot``.

The tiles are written in LLVM's language, which other versions of llvmlite or other processors may refuse. So they are
tried at import, before any code that calls them is compiled.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba.core import config

from hierroom.support.kernel import njit


class Products(NamedTuple):
    """Kernels for contiguous floats a [M, K] or [K, M], b [K, N] and c [M, N]."""

    pack: Callable  # returns a matrix [K, N] in the form for `add_product`
    add_product: Callable  # (a, pack(b), c) adds ``a @ b`` to c
    add_transposed_product: Callable  # (a, b, c) adds ``a.T @ b`` to c

    def work(self) -> bool:
        """Return whether the products are correct, for sizes with whole tiles and with remainders."""
        random = np.random.default_rng(0)
        a, b = random.random((6, 70), np.float32), random.random((70, 150), np.float32)
        expected = 1 + a @ b
        product, transposed = np.ones_like(expected), np.ones_like(expected)
        self.add_product(a, self.pack(b.T.copy().T), product)
        self.add_transposed_product(a.T.copy(), b, transposed)
        return np.allclose(product, expected, rtol=1e-4) and np.allclose(transposed, expected, rtol=1e-4)


@njit(cache=True, nogil=True)
def _copy(matrix):
    return matrix.copy()


@njit(cache=True, nogil=True)
def _add_dot(a, b, c):
    c += np.dot(a, b)


@njit(cache=True, nogil=True)
def _add_transposed_dot(a, b, c):
    c += np.dot(a.T, b)


BLAS = Products(_copy, _add_dot, _add_transposed_dot)


def _working_products() -> Products:
    if config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue] - LLVM cannot run as plain Python
        return BLAS
    try:
        from hierroom.learners.fused.tile_kernels import add_product, add_transposed_product, pack

        tiles = Products(pack, add_product, add_transposed_product)
        if tiles.work():
            return tiles
        reason = "their results are wrong"
    except Exception as error:  # llvmlite, Numba or LLVM may raise anything
        reason = " ".join([type(error).__name__, *str(error).split("\n")[:1]])
    warnings.warn(
        f"the learner's own matrix products do not work here and np.dot takes their place, which is slower ({reason})",
        RuntimeWarning,
        stacklevel=2,
    )
    return BLAS


CHOSEN = _working_products()
pack, add_product, add_transposed_product = CHOSEN
