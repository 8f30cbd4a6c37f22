"""A worker of the compiled learner, which runs shards of a minibatch and sums their gradients."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierroom.learners.config import PPOConfig
from hierroom.learners.fused.adam_kernels import clear
from hierroom.learners.fused.encoder_kernels import (
    add_numbers,
    add_scaled_rows,
    complete_table,
    encode_backward,
    encode_rare,
    numbers_backward,
)
from hierroom.learners.fused.loss_kernels import heads, loss_backward
from hierroom.learners.fused.network import FusedNetwork, Inputs, Parameters, TapeMemory
from hierroom.learners.fused.tapes import RecurrentTape, TrunkTape
from hierroom.learners.networks.actor_critic import RecurrentActorCritic
from hierroom.learners.networks.encoder import FeatureEncoder
from hierroom.learners.rollout import Batch


@dataclass(frozen=True)
class Minibatch:
    """The data that all shards of a minibatch share; `encoder_kernels` explains its arrays."""

    weights: Parameters
    differences: NDArray[np.float32]  # [R + 1, H] from `compare_rows`
    base: NDArray[np.float32]  # [H] from `compare_rows`
    offsets: NDArray[np.int64]  # [K] the table row of each feature's value 0
    common: NDArray[np.integer]  # [K] as given to `rare_rows`
    occurring: NDArray[np.int64]  # [U] table rows that have or had a gradient
    blocks: NDArray[np.int64]  # [B, 2] their parameters and those behind the table, as in `adam_kernels.clear`
    rows: NDArray[np.unsignedinteger]  # [T, M, K or more] from `rare_rows`
    counts: NDArray[np.int64]  # [T, M] from `rare_rows`
    numbers: NDArray[np.float32]  # [T, M, D] scaled
    batch: Batch  # M sequences of T turns, including those of other minibatches
    scores: NDArray[np.float32]  # [T, M] advantages, normalised over this minibatch, times importance weights
    targets: NDArray[np.float32]  # [T, M] value targets
    turn_weight: float  # weight of one turn in the loss


class ShardWorker:
    """Sums the gradients of shards one after the other, in its own memory."""

    def __init__(
        self,
        share: NDArray[np.float32],  # [P] overwritten by the gradient of the flat parameters
        network: FusedNetwork,  # for its shapes
        config: PPOConfig,
    ) -> None:
        self._config = config
        self._share = share
        self._gradient = Parameters.views(share, network)
        codes = Inputs.of(network).codes
        self._fixed = fixed_numbers(codes)
        self._d_table = self._gradient.encoder_weight
        if self._fixed is not None:  # the gradient of the weights is computed from the table's
            self._d_table = np.zeros(codes.table().shape, np.float32)
        self._sums = np.zeros(5)
        self._is_rectified = isinstance(network, RecurrentActorCritic)
        self.memory = tape_memory(self._gradient, network)

    def clear(self, minibatch: Minibatch) -> None:
        """Reset the gradients and sums before a minibatch."""
        clear(self._share, minibatch.blocks)
        if self._fixed is not None:
            self._d_table.fill(0)
        self._sums.fill(0)

    def add_shard(self, minibatch: Minibatch, shard: NDArray[np.integer]) -> None:
        """Add the gradient of the loss of some sequences, by their indices."""
        batch, weights, config = minibatch.batch, minibatch.weights, self._config
        n_turns, n_rows = len(batch.features), len(batch.features) * len(shard)
        tape = self.memory.tape(n_turns, len(shard))

        def of_shard(array: NDArray) -> NDArray:  # [T, M, ...] to [T * shard, ...], contiguous
            return array.take(shard, axis=1).reshape(n_rows, *array.shape[2:])

        rows, counts, numbers = (of_shard(array) for array in (minibatch.rows, minibatch.counts, minibatch.numbers))
        resets, is_last = batch.resets.take(shard, axis=1), not numbers.size
        encode_rare(rows, counts, minibatch.differences, minibatch.base, tape.encoded, is_last and self._is_rectified)
        if numbers.size:
            add_numbers(numbers, weights.number_weight, tape.encoded, self._is_rectified)
        tape.forward(weights, batch.initial_states[shard], resets)
        policy, value = (weights.policy_weight, weights.policy_bias), (weights.value_weight, weights.value_bias)
        heads(tape.policy_hidden, tape.value_hidden, *policy, *value, tape.logits, tape.values)
        gradient, data = self._gradient, (batch.masks, batch.actions, batch.log_probs)
        loss_backward(
            *(tape.policy_hidden, tape.value_hidden, tape.logits, tape.values),
            *(weights.policy_weight, weights.value_weight),
            *(of_shard(array) for array in (*data, minibatch.scores, minibatch.targets)),
            *(config.clip, config.value_weight, config.entropy_weight, minibatch.turn_weight),
            *(tape.d_policy_hidden, tape.d_value_hidden),
            *(gradient.policy_weight, gradient.policy_bias, gradient.value_weight, gradient.value_bias),
            self._sums,
        )
        tape.backward(weights, resets, gradient)
        bias = gradient.encoder_bias
        encode_backward(rows, counts, tape.encoded, tape.d_encoded, self._d_table, bias, self._is_rectified)
        if numbers.size:
            numbers_backward(numbers, tape.d_encoded, gradient.number_weight)

    def finish(self, minibatch: Minibatch) -> NDArray[np.float64]:
        """Complete the gradient; return this worker's part of the first five of `STATISTICS`."""
        places = minibatch.offsets, minibatch.common, minibatch.occurring
        complete_table(*places, self._gradient.encoder_bias, self._d_table)
        if self._fixed is not None:
            rows, columns, numbers = self._fixed
            add_scaled_rows(columns, rows, numbers, self._d_table, self._gradient.encoder_weight)
        return self._sums


def tape_memory(weights: Parameters, network: FusedNetwork) -> TapeMemory:
    """Return memory for the tapes of a network."""
    return TapeMemory(weights, RecurrentTape if isinstance(network, RecurrentActorCritic) else TrunkTape)


def fixed_numbers(codes: FeatureEncoder) -> tuple[NDArray, NDArray, NDArray] | None:
    """Return rows, columns and values of the non-zero encoder inputs; None without fixed numbers."""
    if codes.inputs is None:
        return None
    inputs = codes.inputs.numpy()
    rows, columns = np.nonzero(inputs)
    return rows, columns, inputs[rows, columns]
