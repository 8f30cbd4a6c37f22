"""The passes of the two cores over a block of sequences or turns: see `Tape`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.learners.fused.network import Parameters
from hierroom.learners.fused.recurrent_kernels import lstm_backward, lstm_forward
from hierroom.learners.fused.trunk_kernels import trunks_backward, trunks_forward


class RecurrentTape:
    """A `Tape` of `ResetLSTM`: one trunk for both heads."""

    def __init__(
        self,
        logits: NDArray[np.floating],  # [T M, A]
        values: NDArray[np.floating],  # [T M]
        driven: NDArray[np.floating],  # [T, M, 2 H] encoded features, then the hidden state before the turn
        gates: NDArray[np.floating],  # [T, M, 4 H]
        cells: NDArray[np.floating],  # [T + 1, M, H]
        squashed: NDArray[np.floating],  # [T, M, H]
        hidden: NDArray[np.floating],  # [T, M, H]
        d_hidden: NDArray[np.floating],  # [T, M, H]
        d_driven: NDArray[np.floating],  # [T, M, 2 H]
    ) -> None:
        self.logits, self.values = logits, values
        self._driven, self._gates, self._cells, self._squashed = driven, gates, cells, squashed
        self._hidden, self._d_hidden, self._d_driven = hidden, d_hidden, d_driven
        self.encoded, self.d_encoded = (array.reshape(len(values), -1) for array in (driven, d_driven))
        self.policy_hidden = self.value_hidden = hidden.reshape(len(values), -1)
        self.d_policy_hidden = self.d_value_hidden = d_hidden.reshape(len(values), -1)

    @staticmethod
    def shapes(n_turns: int, n_sequences: int, size: int) -> list[tuple[int, ...]]:
        """Return the shapes of the arrays after logits and values."""
        turns = (n_turns, n_sequences)
        before = [(*turns, 2 * size), (*turns, 4 * size), (n_turns + 1, n_sequences, size), (*turns, size)]
        return [*before, (*turns, size), (*turns, size), (*turns, 2 * size)]

    def forward(self, weights: Parameters, states: NDArray[np.floating], resets: NDArray[np.bool_]) -> None:
        """Compute the hidden states; see `Tape.forward`."""
        written = self._gates, self._cells, self._squashed, self._hidden
        lstm_forward(self._driven, states, resets, weights.core_weight, weights.core_bias, *written)

    def backward(self, weights: Parameters, resets: NDArray[np.bool_], gradient: Parameters) -> None:
        """Backpropagate through time; see `Tape.backward`."""
        written = self._gates, self._cells, self._squashed, self._d_hidden, self._d_driven
        lstm_backward(self._driven, resets, weights.core_weight, *written, gradient.core_weight, gradient.core_bias)

    def write_states(self, states: NDArray[np.floating]) -> None:
        """Write the hidden and the cell states."""
        size = self._hidden.shape[-1]
        states[:, :size], states[:, size:] = self._hidden[-1], self._cells[-1]


class TrunkTape:
    """A `Tape` of `Trunks`: one trunk for each head, and no states."""

    def __init__(
        self,
        logits: NDArray[np.floating],  # [N, A]; N is T M
        values: NDArray[np.floating],  # [N]
        encoded: NDArray[np.floating],  # [N, 2 H]
        d_encoded: NDArray[np.floating],  # [N, 2 H]
        first: NDArray[np.floating],  # [2, N, H] outputs of the first layer, by trunk
        second: NDArray[np.floating],  # [2, N, H] of the second
        d_first: NDArray[np.floating],  # [2, N, H]
        d_second: NDArray[np.floating],  # [2, N, H]
    ) -> None:
        self.logits, self.values, self.encoded, self.d_encoded = logits, values, encoded, d_encoded
        self._first, self._second, self._d_first, self._d_second = first, second, d_first, d_second
        self.policy_hidden, self.value_hidden = second
        self.d_policy_hidden, self.d_value_hidden = d_second

    @staticmethod
    def shapes(n_turns: int, n_sequences: int, size: int) -> list[tuple[int, ...]]:
        """Return the shapes of the arrays after logits and values."""
        n = n_turns * n_sequences
        return [(n, 2 * size)] * 2 + [(2, n, size)] * 4

    def forward(self, weights: Parameters, states: NDArray[np.floating], resets: NDArray[np.bool_]) -> None:
        """Compute both layers; see `Tape.forward`."""
        trunks_forward(self.encoded, weights.core_weight, weights.core_bias, self._first, self._second)

    def backward(self, weights: Parameters, resets: NDArray[np.bool_], gradient: Parameters) -> None:
        """Compute the gradients of both layers; see `Tape.backward`."""
        layers = weights.core_weight, self._first, self._second, self._d_second, self._d_first
        trunks_backward(*layers, self.d_encoded, gradient.core_weight, gradient.core_bias)

    def write_states(self, states: NDArray[np.floating]) -> None:
        """Do nothing, as there are none."""
