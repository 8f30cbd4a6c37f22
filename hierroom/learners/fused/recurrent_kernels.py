"""`ResetLSTM` in compiled kernels: forward and backward through time, with resets inside a sequence.

Inputs and hidden states share the rows of one array ``driven`` [T, M, X + H], so that a step is one matrix product.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.learners.fused.tile_kernels import add_product, add_transposed_product, pack
from hierroom.support.kernel import njit

_DEPTH = 64  # samples of one sum of weight gradients
# Typed as float32, because Numba promotes float32 with a Python number to float64; float64 arrays stay float64.
_HALF, _ONE, _TWO = np.float32(0.5), np.float32(1), np.float32(2)
_LIMIT, _QUARTER = np.float32(12), np.float32(0.25)
_15, _105, _420, _945 = np.float32(15), np.float32(105), np.float32(420), np.float32(945)


@njit(inline="always", error_model="numpy")
def tanh(x):
    """Compute tanh to 2e-9 (apart from rounding) with products and one division, so that loops vectorise.

    Five terms of Lambert's continued fraction give tanh(x / 4) = a / b, and tanh 2y = 2 a b / (a^2 + b^2) is applied
    twice. Beyond 12, 1 - tanh is below 1e-10.
    """
    quarter = min(max(x, -_LIMIT), _LIMIT) * _QUARTER
    square = quarter * quarter
    a = quarter * (_945 + square * (_105 + square))
    b = _945 + square * (_420 + square * _15)
    a, b = _TWO * a * b, a * a + b * b
    return _TWO * a * b / (a * a + b * b)


@njit(inline="always", error_model="numpy")
def _sigmoid(x):
    return _HALF + _HALF * tanh(x * _HALF)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def lstm_forward(
    driven: NDArray[np.floating],  # [T, M, X + H] inputs, then the hidden state before each step, written
    states: NDArray[np.floating],  # [M, 2 H] hidden and cell state before step 0
    resets: NDArray[np.bool_],  # [T, M] whether the state is set to zero before the step
    weight: NDArray[np.floating],  # [X + H, 4 H]
    bias: NDArray[np.floating],  # [4 H]
    gates: NDArray[np.floating],  # [T, M, 4 H] written: input, forget, candidate, output, after nonlinearities
    cells: NDArray[np.floating],  # [T + 1, M, H] written: before each step, and after the last
    squashed: NDArray[np.floating],  # [T, M, H] written: tanh of the cell state after each step
    hidden: NDArray[np.floating],  # [T, M, H] written: the outputs
) -> None:
    """Compute T steps of M sequences; see `ResetLSTM` for the equations."""
    n_steps, n_rows, size = hidden.shape
    before = driven[:, :, driven.shape[2] - size :]
    panels = pack(weight)
    for m in range(n_rows):
        for j in range(size):
            cells[0, m, j] = states[m, size + j]
    for t in range(n_steps):
        for m in range(n_rows):
            previous = states[m] if t == 0 else hidden[t - 1, m]
            for j in range(size):
                before[t, m, j] = previous[j]
            if resets[t, m]:
                before[t, m] = 0
                cells[t, m] = 0
            for j in range(4 * size):
                gates[t, m, j] = bias[j]
        add_product(driven[t], panels, gates[t])
        _cells_forward(gates[t].reshape(n_rows, 4, size), cells[t], cells[t + 1], squashed[t], hidden[t])


@njit(nogil=True, fastmath=True, error_model="numpy")
def _cells_forward(gates, before, after, squashed, hidden):
    """Turn products [M, 4, H] into gates and update the cell states [M, H].

    Every index is a loop variable that counts from 0, because checking that an index such as ``size + j`` is not
    negative would prevent vectorisation. Slicing the rows first takes 50% longer.
    """
    n_rows, size = hidden.shape
    for m in range(n_rows):
        for j in range(size):
            gates[m, 0, j] = _sigmoid(gates[m, 0, j])
        for j in range(size):
            gates[m, 1, j] = _sigmoid(gates[m, 1, j])
        for j in range(size):
            gates[m, 2, j] = tanh(gates[m, 2, j])
        for j in range(size):
            gates[m, 3, j] = _sigmoid(gates[m, 3, j])
        for j in range(size):
            after[m, j] = gates[m, 1, j] * before[m, j] + gates[m, 0, j] * gates[m, 2, j]
        for j in range(size):
            squashed[m, j] = tanh(after[m, j])
        for j in range(size):
            hidden[m, j] = gates[m, 3, j] * squashed[m, j]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def lstm_backward(
    driven: NDArray[np.floating],  # [T, M, X + H] after `lstm_forward`
    resets: NDArray[np.bool_],  # [T, M] as given to `lstm_forward`
    weight: NDArray[np.floating],  # [X + H, 4 H]
    gates: NDArray[np.floating],  # [T, M, 4 H] overwritten by the gradient before the nonlinearities
    cells: NDArray[np.floating],  # [T + 1, M, H] after `lstm_forward`
    squashed: NDArray[np.floating],  # [T, M, H] after `lstm_forward`
    d_hidden: NDArray[np.floating],  # [T, M, H] gradient of the outputs; the gradient through later steps is added
    d_driven: NDArray[np.floating],  # [T, M, X + H] written; its first X entries are the gradient of the inputs
    d_weight: NDArray[np.floating],  # [X + H, 4 H] added to
    d_bias: NDArray[np.floating],  # [4 H] added to
) -> None:
    """Backpropagate through time after `lstm_forward`; the initial states get no gradient."""
    n_steps, n_rows, size = d_hidden.shape
    width = driven.shape[2]
    panels = pack(weight.T)
    d_cells = np.zeros((n_rows, size), weight.dtype)
    stop = n_steps  # steps from here on are already summed into d_weight
    for t in range(n_steps - 1, -1, -1):
        for m in range(n_rows):
            if t < n_steps - 1:
                if resets[t + 1, m]:
                    d_cells[m] = 0
                else:
                    _add(d_driven[t + 1, m, width - size :], d_hidden[t, m])
            _cell_backward(gates[t, m], cells[t, m], squashed[t, m], d_hidden[t, m], d_cells[m])
            _add(gates[t, m], d_bias)
        d_driven[t] = 0
        add_product(gates[t], panels, d_driven[t])
        # Sum several steps at a time: enough for an efficient product, few enough to be in the cache.
        if t == 0 or (stop - t) * n_rows >= _DEPTH:
            n_samples = (stop - t) * n_rows
            left, right = driven[t:stop].reshape(n_samples, width), gates[t:stop].reshape(n_samples, 4 * size)
            add_transposed_product(left, right, d_weight)
            stop = t


@njit(nogil=True, fastmath=True)
def _add(terms, total):
    for j in range(len(total)):
        total[j] += terms[j]


@njit(nogil=True, fastmath=True, error_model="numpy")
def _cell_backward(gates, before, squashed, d_hidden, d_cell):
    """Overwrite a row's gates [4 H] by the products' gradient, and d_cell [H] by the previous cell state's."""
    size = len(d_hidden)
    input_gate, forget_gate = gates[:size], gates[size : 2 * size]
    candidate, output_gate = gates[2 * size : 3 * size], gates[3 * size :]
    for j in range(size):
        d_cell[j] += d_hidden[j] * output_gate[j] * (_ONE - squashed[j] * squashed[j])
    for j in range(size):
        output_gate[j] = d_hidden[j] * squashed[j] * output_gate[j] * (_ONE - output_gate[j])
    for j in range(size):
        d_input = d_cell[j] * candidate[j] * input_gate[j] * (_ONE - input_gate[j])
        candidate[j] = d_cell[j] * input_gate[j] * (_ONE - candidate[j] * candidate[j])
        input_gate[j] = d_input
    for j in range(size):
        d_forget = d_cell[j] * before[j] * forget_gate[j] * (_ONE - forget_gate[j])
        d_cell[j] *= forget_gate[j]
        forget_gate[j] = d_forget
