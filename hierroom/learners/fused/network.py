"""The parameters of networks as views of one flat vector, and the memory of their passes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from hierroom.learners.networks.actor_critic import RecurrentActorCritic
from hierroom.learners.networks.encoder import FeatureEncoder
from hierroom.learners.networks.feed_forward import FeedForwardActorCritic
from hierroom.learners.networks.input_layer import InputLayer

FusedNetwork = RecurrentActorCritic | FeedForwardActorCritic
"""The networks that compiled kernels can train."""


@dataclass(frozen=True)
class Parameters:
    """Views of one flat vector: the parameters of a network or their gradient, in the module's order.

    X is the width of the encoder: H, or 2 H for two trunks.
    """

    encoder_weight: NDArray[np.floating]  # [D, X]; D equals R if no feature has fixed numbers
    encoder_bias: NDArray[np.floating]  # [X]
    number_weight: NDArray[np.floating]  # [numbers, X]; a `FeatureEncoder` reads no numbers
    core_weight: NDArray[np.floating]  # [2 H, 4 H], or [2, H, H] for two trunks
    core_bias: NDArray[np.floating]  # [4 H], or [2, H] for two trunks
    policy_weight: NDArray[np.floating]  # [A, H]
    policy_bias: NDArray[np.floating]  # [A]
    value_weight: NDArray[np.floating]  # [1, H]
    value_bias: NDArray[np.floating]  # [1]

    @classmethod
    def views(cls, vector: NDArray[np.floating], network: FusedNetwork) -> Parameters:
        """Split ``vector`` [P] into views in the shapes of the network's parameters."""
        shapes = [tuple(p.shape) for p in network.parameters()]
        if isinstance(network.encoder, FeatureEncoder):
            shapes.insert(2, (0, *shapes[1]))
        return cls(*split_views(vector, shapes))


@dataclass(frozen=True)
class Inputs:
    """Read the observations of a network for compiled kernels."""

    codes: FeatureEncoder
    layer: InputLayer | None  # None: all K bytes are categories

    @classmethod
    def of(cls, network: FusedNetwork) -> Inputs:
        """Return the inputs of a network."""
        layer = network.encoder
        return cls(layer.codes, layer) if isinstance(layer, InputLayer) else cls(layer, None)

    def read(self, features: NDArray[np.uint8]) -> tuple[NDArray[np.integer], NDArray[np.float32]]:
        """Return the codes [..., C] and the scaled numbers [..., D] of observations [..., K]."""
        if self.layer is None:
            return np.ascontiguousarray(features), np.zeros((*features.shape[:-1], 0), np.float32)
        return np.ascontiguousarray(self.layer.layout.read_codes(features)), self.layer.read_numbers(features)


class Tape(Protocol):
    """The results of a forward pass over T turns of M sequences that the backward pass needs."""

    encoded: NDArray[np.floating]  # [T M, X or more] outputs of the encoder
    d_encoded: NDArray[np.floating]  # [T M, X or more] their gradient
    policy_hidden: NDArray[np.floating]  # [T M, H] what the policy head reads
    value_hidden: NDArray[np.floating]  # [T M, H] what the value head reads; it may be the same array
    d_policy_hidden: NDArray[np.floating]  # [T M, H]
    d_value_hidden: NDArray[np.floating]  # [T M, H]
    logits: NDArray[np.floating]  # [T M, A]
    values: NDArray[np.floating]  # [T M]

    def forward(self, weights: Parameters, states: NDArray[np.floating], resets: NDArray[np.bool_]) -> None:
        """Compute what the heads read, given the encoded features, states [M, S] and resets [T, M]."""

    def backward(self, weights: Parameters, resets: NDArray[np.bool_], gradient: Parameters) -> None:
        """Add the gradient of the core and write `d_encoded`, given the gradients of what the heads read."""

    def write_states(self, states: NDArray[np.floating]) -> None:
        """Write the states [M, S] after the last turn."""


class TapeMemory:
    """Memory for one tape at a time, of any shape; it grows to the largest tape and is never released."""

    def __init__(self, weights: Parameters, kind: Any) -> None:
        self._n_actions, self._hidden_size = weights.policy_weight.shape
        self._flat = np.empty(0, weights.policy_weight.dtype)
        self._kind, self._turns = kind, (0, 0)

    def tape(self, n_turns: int, n_sequences: int) -> Tape:
        """Return a tape for T turns of M sequences with arbitrary contents, which invalidates the previous tape."""
        turns = (n_turns, n_sequences)
        if turns != self._turns:
            n = n_turns * n_sequences
            shapes = [(n, self._n_actions), (n,), *self._kind.shapes(*turns, self._hidden_size)]
            n_numbers = sum(math.prod(shape) for shape in shapes)
            if len(self._flat) < n_numbers:
                self._flat = np.empty(n_numbers, self._flat.dtype)
            self._tape: Tape = self._kind(*split_views(self._flat, shapes))
            self._turns = turns
        return self._tape


def split_views(vector: NDArray[np.floating], shapes: Sequence[tuple[int, ...]]) -> Iterator[NDArray[np.floating]]:
    """Return views of a vector in some shapes, one after the other."""
    parts = np.split(vector, np.cumsum([math.prod(shape) for shape in shapes]))
    return (part.reshape(shape) for part, shape in zip(parts, shapes, strict=False))
