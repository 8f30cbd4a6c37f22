"""Matrix products by ``np.dot``, that is SciPy's BLAS, with the functions of `tile_kernels`: they run anywhere.

BLAS starts its own threads, and with a second busy process they can make a training step ten times slower.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.support.compile.kernel import njit


@njit(cache=True, nogil=True)
def pack(matrix: NDArray[np.floating]) -> NDArray[np.floating]:
    """A matrix [K, N] as `add_product` takes it: row by row."""
    return matrix.copy()


@njit(cache=True, nogil=True)
def add_product(a, packed, c):
    """Add ``a @ b`` to ``c``: a [M, K] float, ``packed = pack(b)`` of b [K, N], c [M, N] float; all contiguous."""
    c += np.dot(a, packed)


@njit(cache=True, nogil=True)
def add_transposed_product(a, b, c):
    """Add ``a.T @ b`` to ``c``: a [K, M] float, b [K, N] float, c [M, N] float; all contiguous."""
    c += np.dot(a.T, b)
