"""`Trunks` in compiled kernels: two layers for each of two trunks, forward and backward."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.learners.fused.recurrent_kernels import tanh
from hierroom.learners.fused.tile_kernels import add_product, add_transposed_product, pack
from hierroom.support.kernel import njit

_ONE = np.float32(1)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def trunks_forward(
    encoded: NDArray[np.floating],  # [N, 2 H] inputs of both trunks
    weight: NDArray[np.floating],  # [2, H, H]
    bias: NDArray[np.floating],  # [2, H]
    first: NDArray[np.floating],  # [2, N, H] written: tanh of the inputs
    second: NDArray[np.floating],  # [2, N, H] written: the outputs
) -> None:
    """Compute the outputs of both trunks; see `Trunks`."""
    _, n_rows, size = first.shape
    pairs = encoded.reshape(n_rows, 2, size)
    for trunk in range(2):
        for n in range(n_rows):
            for j in range(size):
                first[trunk, n, j] = tanh(pairs[n, trunk, j])
            for j in range(size):
                second[trunk, n, j] = bias[trunk, j]
        add_product(first[trunk], pack(weight[trunk]), second[trunk])
        for n in range(n_rows):
            for j in range(size):
                second[trunk, n, j] = tanh(second[trunk, n, j])


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def trunks_backward(
    weight: NDArray[np.floating],  # [2, H, H]
    first: NDArray[np.floating],  # [2, N, H] after `trunks_forward`
    second: NDArray[np.floating],  # [2, N, H] after `trunks_forward`
    d_second: NDArray[np.floating],  # [2, N, H] gradient of the outputs; overwritten
    d_first: NDArray[np.floating],  # [2, N, H] overwritten
    d_encoded: NDArray[np.floating],  # [N, 2 H] written: the gradient of the inputs
    d_weight: NDArray[np.floating],  # [2, H, H] added to
    d_bias: NDArray[np.floating],  # [2, H] added to
) -> None:
    """Backpropagate through both trunks after `trunks_forward`."""
    _, n_rows, size = first.shape
    pairs = d_encoded.reshape(n_rows, 2, size)
    for trunk in range(2):
        for n in range(n_rows):
            for j in range(size):
                d_second[trunk, n, j] *= _ONE - second[trunk, n, j] * second[trunk, n, j]
            for j in range(size):
                d_bias[trunk, j] += d_second[trunk, n, j]
        add_transposed_product(first[trunk], d_second[trunk], d_weight[trunk])
        d_first[trunk] = 0
        add_product(d_second[trunk], pack(weight[trunk].T), d_first[trunk])
        for n in range(n_rows):
            for j in range(size):
                pairs[n, trunk, j] = d_first[trunk, n, j] * (_ONE - first[trunk, n, j] * first[trunk, n, j])
