"""`ResetLSTM` compiled: a sequence forwards, and back through time, with resets inside.

Inputs and hidden states lie side by side in one array ``driven`` [T, M, X + H], so that a step is one matrix product.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Constants are float32 because Numba makes float64 of float32 and a Python number; with float64 they are float64.
_HALF, _ONE, _TWO = np.float32(0.5), np.float32(1), np.float32(2)
_LIMIT, _QUARTER = np.float32(12), np.float32(0.25)
_15, _105, _420, _945 = np.float32(15), np.float32(105), np.float32(420), np.float32(945)


@njit(inline="always")
def _tanh(x):
    """Tanh to 2e-9 (rounding apart) from products and one division, so that a loop over it becomes vector code.

    Lambert's continued fraction gives tanh(x / 4) = a / b to five terms; tanh 2y = 2 a b / (a^2 + b^2) twice does the
    rest. Beyond 12, 1 - tanh is below 1e-10.
    """
    quarter = min(max(x, -_LIMIT), _LIMIT) * _QUARTER
    square = quarter * quarter
    a = quarter * (_945 + square * (_105 + square))
    b = _945 + square * (_420 + square * _15)
    a, b = _TWO * a * b, a * a + b * b
    return _TWO * a * b / (a * a + b * b)


@njit(inline="always")
def _sigmoid(x):
    return _HALF + _HALF * _tanh(x * _HALF)


@njit(cache=True, nogil=True, fastmath=True)
def lstm_forward(
    driven: NDArray[np.floating],
    states: NDArray[np.floating],
    resets: NDArray[np.bool_],
    weight: NDArray[np.floating],
    bias: NDArray[np.floating],
    gates: NDArray[np.floating],
    cells: NDArray[np.floating],
    squashed: NDArray[np.floating],
    hidden: NDArray[np.floating],
) -> None:
    """T steps of M sequences; equations in `ResetLSTM`.

    Args:
        driven: [T, M, X + H] float; the inputs in its first X entries, the hidden state before each step is written
            into the others.
        states: [M, 2 H] float, hidden and cell state before step 0.
        resets: [T, M] bool, where the state is zero before the step.
        weight: [X + H, 4 H] float.
        bias: [4 H] float.
        gates: [T, M, 4 H] float, written: input, forget, candidate and output gates after their nonlinearities.
        cells: [T + 1, M, H] float, written: the cell state before each step, and in the last row after all.
        squashed: [T, M, H] float, written: tanh of the cell state after each step.
        hidden: [T, M, H] float, written: the outputs.
    """
    n_steps, n_rows, size = hidden.shape
    first = driven.shape[2] - size
    for m in range(n_rows):
        for j in range(size):
            cells[0, m, j] = states[m, size + j]
    for t in range(n_steps):
        for m in range(n_rows):
            for j in range(size):
                driven[t, m, first + j] = states[m, j] if t == 0 else hidden[t - 1, m, j]
            if resets[t, m]:
                for j in range(size):
                    driven[t, m, first + j] = 0
                    cells[t, m, j] = 0
        np.dot(driven[t], weight, gates[t])
        for m in range(n_rows):
            for j in range(size):
                enter = _sigmoid(gates[t, m, j] + bias[j])
                forget = _sigmoid(gates[t, m, size + j] + bias[size + j])
                candidate = _tanh(gates[t, m, 2 * size + j] + bias[2 * size + j])
                leave = _sigmoid(gates[t, m, 3 * size + j] + bias[3 * size + j])
                cell = forget * cells[t, m, j] + enter * candidate
                gates[t, m, j] = enter
                gates[t, m, size + j] = forget
                gates[t, m, 2 * size + j] = candidate
                gates[t, m, 3 * size + j] = leave
                cells[t + 1, m, j] = cell
                squashed[t, m, j] = _tanh(cell)
                hidden[t, m, j] = leave * squashed[t, m, j]


@njit(cache=True, nogil=True, fastmath=True)
def lstm_backward(
    driven: NDArray[np.floating],
    resets: NDArray[np.bool_],
    weight: NDArray[np.floating],
    gates: NDArray[np.floating],
    cells: NDArray[np.floating],
    squashed: NDArray[np.floating],
    d_hidden: NDArray[np.floating],
    d_driven: NDArray[np.floating],
    d_weight: NDArray[np.floating],
    d_bias: NDArray[np.floating],
) -> None:
    """Back through time after `lstm_forward`; the stored initial states get no gradient.

    Args:
        driven: [T, M, X + H] float, as `lstm_forward` left it; likewise ``gates``, ``cells`` and ``squashed``.
        resets: [T, M] bool.
        weight: [X + H, 4 H] float.
        gates: [T, M, 4 H] float; overwritten by the gradient before the nonlinearities.
        cells: [T + 1, M, H] float.
        squashed: [T, M, H] float.
        d_hidden: [T, M, H] float, gradient of the outputs; overwritten by that through later steps too.
        d_driven: [T, M, X + H] float, written; its first X entries are the gradient of the inputs.
        d_weight: [X + H, 4 H] float, added to.
        d_bias: [4 H] float, added to.
    """
    n_steps, n_rows, size = d_hidden.shape
    width = driven.shape[2]
    first = width - size
    transposed = np.ascontiguousarray(weight.T)
    d_cells = np.zeros((n_rows, size), weight.dtype)
    for t in range(n_steps - 1, -1, -1):
        for m in range(n_rows):
            if t < n_steps - 1:
                if resets[t + 1, m]:
                    for j in range(size):
                        d_cells[m, j] = 0
                else:
                    for j in range(size):
                        d_hidden[t, m, j] += d_driven[t + 1, m, first + j]
            for j in range(size):
                enter = gates[t, m, j]
                forget = gates[t, m, size + j]
                candidate = gates[t, m, 2 * size + j]
                leave = gates[t, m, 3 * size + j]
                d_output = d_hidden[t, m, j]
                d_cell = d_cells[m, j] + d_output * leave * (_ONE - squashed[t, m, j] * squashed[t, m, j])
                gates[t, m, j] = d_cell * candidate * enter * (_ONE - enter)
                gates[t, m, size + j] = d_cell * cells[t, m, j] * forget * (_ONE - forget)
                gates[t, m, 2 * size + j] = d_cell * enter * (_ONE - candidate * candidate)
                gates[t, m, 3 * size + j] = d_output * squashed[t, m, j] * leave * (_ONE - leave)
                d_cells[m, j] = d_cell * forget
            for j in range(4 * size):
                d_bias[j] += gates[t, m, j]
        np.dot(gates[t], transposed, d_driven[t])
    n_samples = n_steps * n_rows
    d_weight += np.dot(driven.reshape(n_samples, width).T, gates.reshape(n_samples, 4 * size))
