"""`RecurrentActorCritic` out of compiled kernels: forward and backward over a block of sequences."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import torch
from numpy.typing import NDArray

from hierroom.learners.encoder_kernels import encode, encode_backward
from hierroom.learners.loss_kernels import heads
from hierroom.learners.networks import RecurrentActorCritic
from hierroom.learners.recurrent_kernels import lstm_backward, lstm_forward


@dataclass(frozen=True)
class Weights:
    """Views of one flat vector: the parameters of `RecurrentActorCritic`, or a gradient, in the module's order."""

    encoder_weight: NDArray[np.floating]  # [D, H], D inputs: the table's rows R unless columns are fed as numbers
    encoder_bias: NDArray[np.floating]  # [H]
    core_weight: NDArray[np.floating]  # [2 H, 4 H]
    core_bias: NDArray[np.floating]  # [4 H]
    policy_weight: NDArray[np.floating]  # [A, H]
    policy_bias: NDArray[np.floating]  # [A]
    value_weight: NDArray[np.floating]  # [1, H]
    value_bias: NDArray[np.floating]  # [1]

    @classmethod
    def views(cls, vector: NDArray[np.floating], network: RecurrentActorCritic) -> Weights:
        """The parts of ``vector`` [P], shaped like the parameters of ``network``."""
        shapes = [tuple(p.shape) for p in network.parameters()]
        stops = np.cumsum([int(np.prod(shape)) for shape in shapes])
        parts = np.split(vector, stops[:-1])
        return cls(*(part.reshape(shape) for part, shape in zip(parts, shapes, strict=True)))

    def arrays(self) -> list[NDArray[np.floating]]:
        """The views in the module's order."""
        return [getattr(self, field.name) for field in fields(self)]


class Tape:
    """What a forward pass over T turns of M sequences leaves for the backward pass; allocated once, used again.

    Args:
        n_turns: T.
        n_sequences: M.
        weights: parameters, for their sizes and dtype.
    """

    def __init__(self, n_turns: int, n_sequences: int, weights: Weights) -> None:
        n_actions, hidden_size = weights.policy_weight.shape

        def empty(*shape: int) -> NDArray[np.floating]:
            return np.empty(shape, weights.policy_weight.dtype)

        self.driven = empty(n_turns, n_sequences, 2 * hidden_size)  # features beside the hidden state before
        self.gates = empty(n_turns, n_sequences, 4 * hidden_size)
        self.cells = empty(n_turns + 1, n_sequences, hidden_size)
        self.squashed = empty(n_turns, n_sequences, hidden_size)
        self.hidden = empty(n_turns, n_sequences, hidden_size)
        self.logits = empty(n_turns * n_sequences, n_actions)
        self.values = empty(n_turns * n_sequences)
        self.d_hidden = empty(n_turns, n_sequences, hidden_size)
        self.d_driven = empty(n_turns, n_sequences, 2 * hidden_size)


def encoder_table(network: RecurrentActorCritic) -> tuple[NDArray[np.floating], NDArray[np.int64]]:
    """The encoder's rows [R, H] as they are now, and the row [K] int64 of each column's value 0."""
    with torch.no_grad():
        return network.encoder.table().numpy(), network.encoder.offsets.numpy()


def forward(
    weights: Weights,
    table: NDArray[np.floating],
    offsets: NDArray[np.int64],
    codes: NDArray[np.uint8],
    states: NDArray[np.floating],
    resets: NDArray[np.bool_],
    tape: Tape,
) -> None:
    """Logits and values of T turns of M sequences, left on the tape with all that led to them.

    Args:
        weights: the parameters.
        table: [R, H] float, the encoder's rows.
        offsets: [K] int64, the row of each column's value 0.
        codes: [T, M, K] uint8.
        states: [M, 2 H] float, before turn 0.
        resets: [T, M] bool.
        tape: of the same T and M.
    """
    rows = tape.driven.reshape(-1, tape.driven.shape[-1])  # [T M, 2 H]
    encode(codes.reshape(len(rows), -1), offsets, table, weights.encoder_bias, rows)
    lstm_forward(
        tape.driven,
        states,
        resets,
        weights.core_weight,
        weights.core_bias,
        tape.gates,
        tape.cells,
        tape.squashed,
        tape.hidden,
    )
    heads(
        tape.hidden.reshape(len(rows), -1),
        weights.policy_weight,
        weights.policy_bias,
        weights.value_weight,
        weights.value_bias,
        tape.logits,
        tape.values,
    )


def backward(
    weights: Weights,
    offsets: NDArray[np.int64],
    codes: NDArray[np.uint8],
    skipped: NDArray[np.uint8],
    resets: NDArray[np.bool_],
    tape: Tape,
    gradient: Weights,
    d_table: NDArray[np.floating],
) -> None:
    """Add the gradients of core and encoder, given that of the core's outputs in ``tape.d_hidden``.

    The table's is complete only after `encoder_kernels.complete_table`.

    Args:
        weights: the parameters.
        offsets: as given to `forward`, like ``codes`` and ``resets``.
        codes: [T, M, K] uint8.
        skipped: [K] uint8, the values `encode_backward` skips.
        resets: [T, M] bool.
        tape: as `forward` left it; used up.
        gradient: added to.
        d_table: [R, H] float, added to.
    """
    lstm_backward(
        tape.driven,
        resets,
        weights.core_weight,
        tape.gates,
        tape.cells,
        tape.squashed,
        tape.d_hidden,
        tape.d_driven,
        gradient.core_weight,
        gradient.core_bias,
    )
    rows = tape.driven.reshape(-1, tape.driven.shape[-1])
    d_rows = tape.d_driven.reshape(rows.shape)
    encode_backward(codes.reshape(len(rows), -1), offsets, skipped, rows, d_rows, d_table, gradient.encoder_bias)
