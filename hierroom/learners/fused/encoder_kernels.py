"""`FeatureEncoder` in compiled kernels: sums of table rows forward, scattered gradients backward.

Most cells of a view rarely change. So an update sums the rows of each feature's most common value once. A turn then
adds the difference of two rows for each feature with another value. The backward pass skips the most common values.
Each turn adds its gradient to one row per feature, so the skipped row gets the total minus the other rows' gradients.

Arrays of encoded features may be wider than H: the rest of a row has the hidden state for the recurrent core.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.support.kernel import njit


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def encode(
    features: NDArray[np.integer],  # [N, K]
    offsets: NDArray[np.int64],  # [K] the table row of each feature's value 0
    table: NDArray[np.floating],  # [R, H]
    bias: NDArray[np.floating],  # [H]
    encoded: NDArray[np.floating],  # [N, H or more] written
    rectified: bool,
) -> None:
    """Write the bias plus one table row per feature, and its ReLU if ``rectified``."""
    n_samples, n_features = features.shape
    width = len(bias)
    zero = table.dtype.type(0)  # typed: a plain 0 would make Numba compute in float64
    n_eights = n_features // 8 * 8
    for n in range(n_samples):
        for j in range(width):
            encoded[n, j] = bias[j]
        # Eight rows at a time, so that an output is loaded and stored once for eight additions.
        for k in range(0, n_eights, 8):
            row0, row1 = offsets[k] + features[n, k], offsets[k + 1] + features[n, k + 1]
            row2, row3 = offsets[k + 2] + features[n, k + 2], offsets[k + 3] + features[n, k + 3]
            row4, row5 = offsets[k + 4] + features[n, k + 4], offsets[k + 5] + features[n, k + 5]
            row6, row7 = offsets[k + 6] + features[n, k + 6], offsets[k + 7] + features[n, k + 7]
            for j in range(width):
                encoded[n, j] += (
                    (table[row0, j] + table[row1, j])
                    + (table[row2, j] + table[row3, j])
                    + (table[row4, j] + table[row5, j])
                    + (table[row6, j] + table[row7, j])
                )
        for k in range(n_eights, n_features):
            row = offsets[k] + features[n, k]
            for j in range(width):
                encoded[n, j] += table[row, j]
        if rectified:
            for j in range(width):
                encoded[n, j] = max(encoded[n, j], zero)


def most_common(features: NDArray[np.integer]) -> NDArray[np.integer]:
    """Return the most common value [K] of each feature in ``features`` [N, K], or 0 where values may exceed a byte."""
    n_features = features.shape[-1]
    if features.dtype != np.uint8:
        return np.zeros(n_features, features.dtype)
    counts = np.bincount((features + 256 * np.arange(n_features)).ravel(), minlength=256 * n_features)
    return counts.reshape(n_features, 256).argmax(axis=1).astype(np.uint8)


def rare_rows(
    features: NDArray[np.integer],  # [..., K]
    offsets: NDArray[np.int64],  # [K] the table row of each feature's value 0
    common: NDArray[np.integer],  # [K] one value of each feature; the most common ones are fastest
    used: NDArray[np.bool_],  # [R] set to True for each table row that occurs
) -> tuple[NDArray[np.unsignedinteger], NDArray[np.int64]]:
    """Find the table rows of all values except the common ones.

    Returns:
        rows [..., K rounded up to a multiple of four] uint16 or uint32, padded with R to a multiple of four, and their
        number [...] int64 before the padding.
    """
    n_features, n_table_rows = features.shape[-1], len(used)
    rows = np.empty((*features.shape[:-1], -(-n_features // 4) * 4), np.uint16 if n_table_rows < 2**16 else np.uint32)
    counts = np.empty(features.shape[:-1], np.int64)
    flat = features.reshape(-1, n_features)
    _write_rare_rows(flat, offsets, common, used, rows.reshape(len(flat), -1), counts.reshape(-1))
    return rows, counts


@njit(cache=True, nogil=True)
def _write_rare_rows(features, offsets, common, used, rows, counts):
    n_samples, n_features = features.shape
    for n in range(n_samples):
        count = 0
        for k in range(n_features):  # without a branch, which would be mispredicted often
            row = offsets[k] + features[n, k]
            rows[n, count] = row
            used[row] = True
            count += features[n, k] != common[k]
        counts[n] = count
        for i in range(count, -(-count // 4) * 4):
            rows[n, i] = len(used)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def compare_rows(
    table: NDArray[np.floating],  # [R, H]
    bias: NDArray[np.floating],  # [H]
    offsets: NDArray[np.int64],  # [K]
    common: NDArray[np.integer],  # [K] as given to `rare_rows`
    occurring: NDArray[np.int64],  # [U] the rows to compare, ascending: all that `rare_rows` set
    differences: NDArray[np.floating],  # [R + 1, H] written: each row minus its feature's common row; then zeros
    base: NDArray[np.floating],  # [H] written: the bias plus the common rows
) -> None:
    """Write the rows that `encode_rare` adds."""
    n_features, width = len(offsets), len(bias)
    for j in range(width):
        base[j] = bias[j]
    u = 0
    for k in range(n_features):
        stop = offsets[k + 1] if k + 1 < n_features else len(table)
        shared = offsets[k] + common[k]
        while u < len(occurring) and occurring[u] < stop:
            row = occurring[u]
            for j in range(width):
                differences[row, j] = table[row, j] - table[shared, j]
            u += 1
        for j in range(width):
            base[j] += table[shared, j]
    differences[len(table)] = 0


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def encode_rare(
    rows: NDArray[np.unsignedinteger],  # [N, K or more], from `rare_rows`
    counts: NDArray[np.int64],  # [N] from `rare_rows`
    differences: NDArray[np.floating],  # [R + 1, H] from `compare_rows`
    base: NDArray[np.floating],  # [H] from `compare_rows`
    encoded: NDArray[np.floating],  # [N, H or more] written
    rectified: bool,
) -> None:
    """Compute the same as `encode` from the output of `rare_rows` and `compare_rows`."""
    width = len(base)
    zero = base.dtype.type(0)
    for n in range(len(counts)):
        for j in range(width):
            encoded[n, j] = base[j]
        for i in range(0, counts[n], 4):
            row0, row1, row2, row3 = rows[n, i], rows[n, i + 1], rows[n, i + 2], rows[n, i + 3]
            for j in range(width):
                encoded[n, j] += (differences[row0, j] + differences[row1, j]) + (
                    differences[row2, j] + differences[row3, j]
                )
        if rectified:
            for j in range(width):
                encoded[n, j] = max(encoded[n, j], zero)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def encode_backward(
    rows: NDArray[np.unsignedinteger],  # [N, K or more], as given to `encode_rare`
    counts: NDArray[np.int64],  # [N] as given to `encode_rare`
    encoded: NDArray[np.floating],  # [N, H or more] as written by `encode_rare`
    d_encoded: NDArray[np.floating],  # [N, H or more] overwritten by the gradient before the ReLU, if there is one
    d_table: NDArray[np.floating],  # [R, H] added to
    d_bias: NDArray[np.floating],  # [H] added to
    rectified: bool,
) -> None:
    """Add the gradients of the bias and of all table rows except those that `complete_table` fills in."""
    width = len(d_bias)
    zero = d_bias.dtype.type(0)
    for n in range(len(counts)):
        for j in range(width):
            d_encoded[n, j] = d_encoded[n, j] if encoded[n, j] > zero or not rectified else zero
            d_bias[j] += d_encoded[n, j]
        for i in range(counts[n]):
            row = rows[n, i]
            for j in range(width):
                d_table[row, j] += d_encoded[n, j]


@njit(cache=True, nogil=True, fastmath=True)
def complete_table(
    offsets: NDArray[np.int64],  # [K] as given to `rare_rows`
    common: NDArray[np.integer],  # [K] as given to `rare_rows`
    occurring: NDArray[np.int64],  # [U] as given to `compare_rows`
    d_bias: NDArray[np.floating],  # [H] the bias gradient of exactly these samples
    d_table: NDArray[np.floating],  # [R, H] the table gradient of exactly these samples; its common rows are written
) -> None:
    """Fill in the rows that `encode_backward` skipped, after it was called with all samples."""
    n_features, u = len(offsets), 0
    for k in range(n_features):
        stop = offsets[k + 1] if k + 1 < n_features else len(d_table)
        shared = offsets[k] + common[k]
        left = d_bias.copy()
        while u < len(occurring) and occurring[u] < stop:
            if occurring[u] != shared:
                left -= d_table[occurring[u]]
            u += 1
        for j in range(len(left)):
            d_table[shared, j] = left[j]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def add_numbers(
    numbers: NDArray[np.floating],  # [N, D]
    weight: NDArray[np.floating],  # [D, H]
    encoded: NDArray[np.floating],  # [N, H or more] added to
    rectified: bool,
) -> None:
    """Add the product of numbers and weights, and apply the ReLU if ``rectified``."""
    zero = weight.dtype.type(0)
    for n in range(len(numbers)):
        for d in range(len(weight)):
            for j in range(weight.shape[1]):
                encoded[n, j] += numbers[n, d] * weight[d, j]
        if rectified:
            for j in range(weight.shape[1]):
                encoded[n, j] = max(encoded[n, j], zero)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def numbers_backward(
    numbers: NDArray[np.floating],  # [N, D] as given to `add_numbers`
    d_encoded: NDArray[np.floating],  # [N, H or more] as overwritten by `encode_backward`
    d_weight: NDArray[np.floating],  # [D, H] added to
) -> None:
    """Add the gradient of the weights of numbers."""
    for n in range(len(numbers)):
        for d in range(len(d_weight)):
            for j in range(d_weight.shape[1]):
                d_weight[d, j] += numbers[n, d] * d_encoded[n, j]


@njit(cache=True, nogil=True, fastmath=True)
def add_scaled_rows(
    targets: NDArray[np.int64],
    sources: NDArray[np.int64],
    factors: NDArray[np.floating],
    rows: NDArray[np.floating],
    sums: NDArray[np.floating],
) -> None:
    """Add ``factors[i] * rows[sources[i]]`` to ``sums[targets[i]]`` for every i: a sparse matrix times ``rows``.

    The non-zero entries of `FeatureEncoder.inputs` [R, D] give the table [R, H] from the weights [D, H]. With the first
    two arguments exchanged, they give the gradient of the weights from that of the table.
    """
    for i in range(len(targets)):
        target, source, factor = targets[i], sources[i], factors[i]
        for j in range(rows.shape[1]):
            sums[target, j] += factor * rows[source, j]
