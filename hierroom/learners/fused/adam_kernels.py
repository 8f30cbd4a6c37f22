"""Gradient clipping and Adam over one flat vector of parameters, a block of it after the other.

A row of the encoder's table gets no gradient until its feature has its value. Tasks with many goals have thousands of
such rows. So the kernels visit only the blocks that had a gradient: a parameter whose gradient and moments are zero
does not change.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hierroom.support.kernel import njit

BETA1, BETA2 = 0.9, 0.999
"""Decay rates of the two moments: the values of Kingma & Ba (2015) and of torch."""

LEAST_MEAN, LEAST_SQUARE = 1e-30, 1e-37
"""Moments below these become zero. Otherwise those of unused table rows decay to denormal numbers, which slow down
every later step. They would stay there, as 0.9 times the smallest denormal number rounds to itself."""


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def clear(gradient: NDArray[np.floating], blocks: NDArray[np.int64]) -> None:
    """Set the blocks [B, 2], each with its first index and the one after its last, of a gradient [P] to zero."""
    for b in range(len(blocks)):
        gradient[blocks[b, 0] : blocks[b, 1]] = 0


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def sum_gradients(shares: NDArray[np.floating], blocks: NDArray[np.int64]) -> None:
    """Sum blocks of gradients [L, P] into the first row, in order."""
    total = shares[0]
    for share in range(1, len(shares)):
        added = shares[share]
        for b in range(len(blocks)):
            for i in range(blocks[b, 0], blocks[b, 1]):
                total[i] += added[i]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def norm(gradient: NDArray[np.floating]) -> float:
    """Return the Euclidean norm of a gradient [P]."""
    square = 0.0
    for i in range(len(gradient)):
        square += gradient[i] * gradient[i]
    return math.sqrt(square)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def norm_of_blocks(gradient: NDArray[np.floating], blocks: NDArray[np.int64]) -> float:
    """Return the Euclidean norm of a gradient [P] that is zero outside of blocks, as in `clear`."""
    square = 0.0
    for b in range(len(blocks)):
        for i in range(blocks[b, 0], blocks[b, 1]):
            square += gradient[i] * gradient[i]
    return math.sqrt(square)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def adam_step(
    parameters: NDArray[np.floating],  # [P] updated in place
    gradient: NDArray[np.floating],  # [P]
    means: NDArray[np.floating],  # [P] m, updated in place
    squares: NDArray[np.floating],  # [P] v, updated in place
    blocks: NDArray[np.int64],  # [B, 2] the parameters to update, as in `clear`
    scale: float,  # factor from gradient clipping, 0 to 1
    learning_rate: float,  # alpha
    epsilon: float,  # constant in the denominator
    step: int,  # t, 1 for the first step
) -> None:
    r"""Take one step of Adam (Kingma & Ba 2015, algorithm 1) along ``scale`` times the gradient.

    .. math::
        m &\leftarrow \beta_1 m + (1 - \beta_1) g, \qquad v \leftarrow \beta_2 v + (1 - \beta_2) g^2 \\
        \theta &\leftarrow \theta - \alpha\, \frac{m / (1 - \beta_1^t)}{\sqrt{v / (1 - \beta_2^t)} + \epsilon}
    """
    for b in range(len(blocks)):
        first, stop = blocks[b]
        vectors = parameters[first:stop], gradient[first:stop], means[first:stop], squares[first:stop]
        _adam_step(*vectors, scale, learning_rate, epsilon, step)


@njit(nogil=True, fastmath=True, error_model="numpy")
def _adam_step(parameters, gradient, means, squares, scale, learning_rate, epsilon, step):
    to_float = parameters.dtype.type  # keeps float32 parameters in float32 arithmetic
    rate = to_float(learning_rate / (1 - BETA1**step))
    correction = to_float(1 / (1 - BETA2**step))
    keep1, keep2, shrink, floor = to_float(BETA1), to_float(BETA2), to_float(scale), to_float(epsilon)
    take1, take2 = to_float(1 - BETA1), to_float(1 - BETA2)
    nothing, least_mean, least_square = to_float(0), to_float(LEAST_MEAN), to_float(LEAST_SQUARE)
    for i in range(len(parameters)):
        slope = shrink * gradient[i]
        mean = keep1 * means[i] + take1 * slope
        means[i] = mean if abs(mean) > least_mean else nothing
        square = keep2 * squares[i] + take2 * slope * slope
        squares[i] = square if square > least_square else nothing
        parameters[i] -= rate * mean / (np.sqrt(square * correction) + floor)
