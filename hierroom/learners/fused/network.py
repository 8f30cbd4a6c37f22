"""`RecurrentActorCritic` in compiled kernels: forward and backward passes over a block of sequences."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierroom.learners.fused.encoder_kernels import encode_backward
from hierroom.learners.fused.loss_kernels import heads
from hierroom.learners.fused.recurrent_kernels import lstm_backward, lstm_forward
from hierroom.learners.networks.actor_critic import RecurrentActorCritic


@dataclass(frozen=True)
class Parameters:
    """Views of one flat vector: the parameters of `RecurrentActorCritic` or their gradient, in the module's order."""

    encoder_weight: NDArray[np.floating]  # [D, H]; D equals R if no feature has fixed numbers
    encoder_bias: NDArray[np.floating]  # [H]
    core_weight: NDArray[np.floating]  # [2 H, 4 H]
    core_bias: NDArray[np.floating]  # [4 H]
    policy_weight: NDArray[np.floating]  # [A, H]
    policy_bias: NDArray[np.floating]  # [A]
    value_weight: NDArray[np.floating]  # [1, H]
    value_bias: NDArray[np.floating]  # [1]

    @classmethod
    def views(cls, vector: NDArray[np.floating], network: RecurrentActorCritic) -> Parameters:
        """Split ``vector`` [P] into views in the shapes of the network's parameters."""
        return cls(*_views(vector, [tuple(p.shape) for p in network.parameters()]))


@dataclass(frozen=True)
class Tape:
    """The results of a forward pass over T turns of M sequences that the backward pass needs."""

    driven: NDArray[np.floating]  # [T, M, 2 H] encoded features, then the hidden state before the turn
    gates: NDArray[np.floating]  # [T, M, 4 H]
    cells: NDArray[np.floating]  # [T + 1, M, H]
    squashed: NDArray[np.floating]  # [T, M, H]
    hidden: NDArray[np.floating]  # [T, M, H]
    logits: NDArray[np.floating]  # [T M, A]
    values: NDArray[np.floating]  # [T M]
    d_hidden: NDArray[np.floating]  # [T, M, H]
    d_driven: NDArray[np.floating]  # [T, M, 2 H]

    @property
    def encoded(self) -> NDArray[np.floating]:
        """Outputs [T M, 2 H]; the first H entries of a row are the encoder's."""
        return self.driven.reshape(-1, self.driven.shape[-1])


class TapeMemory:
    """Memory for one tape at a time, of any shape; it grows to the largest tape and is never released."""

    def __init__(self, weights: Parameters) -> None:
        self._n_actions, self._hidden_size = weights.policy_weight.shape
        self._flat = np.empty(0, weights.policy_weight.dtype)
        self._turns = (0, 0)

    def tape(self, n_turns: int, n_sequences: int) -> Tape:
        """Return a tape for T turns of M sequences with arbitrary contents, which invalidates the previous tape."""
        turns, size = (n_turns, n_sequences), self._hidden_size
        if turns == self._turns:
            return self._tape
        shapes = [(*turns, 2 * size), (*turns, 4 * size), (n_turns + 1, n_sequences, size)]
        shapes += [(*turns, size), (*turns, size), (n_turns * n_sequences, self._n_actions), (n_turns * n_sequences,)]
        shapes += [(*turns, size), (*turns, 2 * size)]
        n_numbers = sum(math.prod(shape) for shape in shapes)
        if len(self._flat) < n_numbers:
            self._flat = np.empty(n_numbers, self._flat.dtype)
        self._tape = Tape(*_views(self._flat, shapes))
        self._turns = turns
        return self._tape


def _views(vector: NDArray[np.floating], shapes: list[tuple[int, ...]]) -> Iterator[NDArray[np.floating]]:
    parts = np.split(vector, np.cumsum([math.prod(shape) for shape in shapes]))
    return (part.reshape(shape) for part, shape in zip(parts, shapes, strict=False))


def forward(
    weights: Parameters,
    states: NDArray[np.floating],  # [M, 2 H] the states before turn 0
    resets: NDArray[np.bool_],  # [T, M] whether the state is set to zero before the turn
    tape: Tape,  # with the encoded features
) -> None:
    """Compute logits and values of T turns of M sequences, and keep all results on the tape."""
    written = tape.gates, tape.cells, tape.squashed, tape.hidden
    lstm_forward(tape.driven, states, resets, weights.core_weight, weights.core_bias, *written)
    policy, value = (weights.policy_weight, weights.policy_bias), (weights.value_weight, weights.value_bias)
    heads(tape.hidden.reshape(len(tape.encoded), -1), *policy, *value, tape.logits, tape.values)


def backward(
    weights: Parameters,
    rows: NDArray[np.unsignedinteger],  # [T M, K or more], as given to `encode_rare`
    counts: NDArray[np.int64],  # [T M] as given to `encode_rare`
    resets: NDArray[np.bool_],  # [T, M] as given to `forward`
    tape: Tape,  # after `forward`; overwritten
    gradient: Parameters,  # added to
    d_table: NDArray[np.floating],  # [R, H] added to
) -> None:
    """Add the gradients of core and encoder, given ``tape.d_hidden``; `complete_table` must follow."""
    written = tape.gates, tape.cells, tape.squashed, tape.d_hidden, tape.d_driven
    lstm_backward(tape.driven, resets, weights.core_weight, *written, gradient.core_weight, gradient.core_bias)
    d_encoded = tape.d_driven.reshape(tape.encoded.shape)
    encode_backward(rows, counts, tape.encoded, d_encoded, d_table, gradient.encoder_bias)
