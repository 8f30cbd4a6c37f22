"""`ColumnEncoder` compiled: sums of table rows forwards, scattered gradients backwards.

Feature arrays may be wider than H; only the first H entries of a row are used, so that the recurrent core finds
features and hidden state side by side without a copy.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Samples between which the scatter walks the columns: their gradients and one column's rows stay in the first cache.
_BLOCK = 64


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def encode(
    codes: NDArray[np.uint8],
    offsets: NDArray[np.int64],
    table: NDArray[np.floating],
    bias: NDArray[np.floating],
    features: NDArray[np.floating],
) -> None:
    """ReLU of the bias plus one table row per column.

    Args:
        codes: [N, K] uint8.
        offsets: [K] int64, the table row of each column's value 0.
        table: [R, H] float.
        bias: [H] float.
        features: [N, H or more] float, written.
    """
    n_samples, n_columns = codes.shape
    width = len(bias)
    zero = table.dtype.type(0)  # typed: a plain 0 would make Numba compute in float64
    n_fours = n_columns // 4 * 4
    for n in range(n_samples):
        for j in range(width):
            features[n, j] = bias[j]
        # Four rows at a time: a feature is loaded and stored once for four additions.
        for k in range(0, n_fours, 4):
            row0 = offsets[k] + codes[n, k]
            row1 = offsets[k + 1] + codes[n, k + 1]
            row2 = offsets[k + 2] + codes[n, k + 2]
            row3 = offsets[k + 3] + codes[n, k + 3]
            for j in range(width):
                features[n, j] += (table[row0, j] + table[row1, j]) + (table[row2, j] + table[row3, j])
        for k in range(n_fours, n_columns):
            row = offsets[k] + codes[n, k]
            for j in range(width):
                features[n, j] += table[row, j]
        for j in range(width):
            features[n, j] = max(features[n, j], zero)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def encode_backward(
    codes: NDArray[np.uint8],
    offsets: NDArray[np.int64],
    features: NDArray[np.floating],
    d_features: NDArray[np.floating],
    d_table: NDArray[np.floating],
    d_bias: NDArray[np.floating],
) -> None:
    """Add the gradients of table and bias.

    Args:
        codes: [N, K] uint8, as given to `encode`.
        offsets: [K] int64.
        features: [N, H or more] float, as `encode` wrote them.
        d_features: [N, H or more] float, gradient of the features; overwritten by that before the ReLU.
        d_table: [R, H] float, added to.
        d_bias: [H] float, added to.
    """
    n_samples, n_columns = codes.shape
    width = len(d_bias)
    zero = d_table.dtype.type(0)
    for n in range(n_samples):
        for j in range(width):
            d_features[n, j] = d_features[n, j] if features[n, j] > zero else zero
            d_bias[j] += d_features[n, j]
    for start in range(0, n_samples, _BLOCK):
        stop = min(start + _BLOCK, n_samples)
        for k in range(n_columns):
            for n in range(start, stop):
                row = offsets[k] + codes[n, k]
                for j in range(width):
                    d_table[row, j] += d_features[n, j]
