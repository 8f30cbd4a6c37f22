"""The pass of a network without memory over a block of turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.learners.fused.network import Parameters
from hierroom.learners.fused.trunk_kernels import trunks_backward, trunks_forward


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
