"""Forward passes of one turn in compiled kernels, with their own memory."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from hierroom.learners.fused.encoder_kernels import add_numbers, add_scaled_rows, encode
from hierroom.learners.fused.loss_kernels import heads
from hierroom.learners.fused.network import FusedNetwork, Inputs, Parameters, TapeMemory
from hierroom.learners.fused.shard_worker import tape_memory
from hierroom.learners.networks.actor_critic import RecurrentActorCritic
from hierroom.support.thread_pool import ThreadPool

MAX_PARTS = 8
_MIN_ENVS_PER_THREAD = 256  # for fewer environments, waking another thread takes longer than the computation


class FusedStepper:
    """Computes turns with the current weights of a network.

    Each learner and each policy has its own stepper, because every turn overwrites the memory. So several threads may
    act with the same weights at the same time.

    Args:
        network: gives the shapes and the initial states.
        weights: the network's parameters, shared.
        numbers: fixed numbers of its encoder, from `shard_worker.fixed_numbers`.
        pool: computes with at most `MAX_PARTS` of its threads.
    """

    def __init__(
        self,
        network: FusedNetwork,
        weights: Parameters,
        numbers: tuple[NDArray, NDArray, NDArray] | None,
        pool: ThreadPool,
    ) -> None:
        self._network, self._weights, self._numbers, self._pool = network, weights, numbers, pool
        self._inputs = Inputs.of(network)
        self._offsets = self._inputs.codes.offsets.numpy()
        self._n_table_rows = len(self._inputs.codes.table())
        self._is_rectified = isinstance(network, RecurrentActorCritic)
        self._memories = [tape_memory(weights, network) for _ in range(min(pool.threads, MAX_PARTS))]

    def initial_states(self, n: int) -> NDArray[np.float32]:
        """Return the recurrent states [n, S] at the start of an episode."""
        return self._network.initial_state(n).numpy()

    def step(self, features: NDArray[np.uint8], states: NDArray[np.float32]) -> tuple[NDArray, NDArray, NDArray]:
        """Compute one turn; see `TorchBackend.step`."""
        num_envs, weights, table = len(features), self._weights, self.table()
        codes, numbers = self._inputs.read(features)
        logits = np.empty((num_envs, len(weights.policy_bias)), np.float32)
        values, new_states, is_last = np.empty(num_envs, np.float32), np.empty_like(states), not numbers.size
        policy, value = (weights.policy_weight, weights.policy_bias), (weights.value_weight, weights.value_bias)

        def work(memory: TapeMemory, envs: slice) -> None:
            n = envs.stop - envs.start
            tape = memory.tape(1, n)
            is_rectified = is_last and self._is_rectified
            encode(codes[envs], self._offsets, table, weights.encoder_bias, tape.encoded, is_rectified)
            if numbers.size:
                add_numbers(numbers[envs], weights.number_weight, tape.encoded, self._is_rectified)
            tape.forward(weights, states[envs], np.zeros((1, n), bool))
            heads(tape.policy_hidden, tape.value_hidden, *policy, *value, tape.logits, tape.values)
            logits[envs], values[envs] = tape.logits, tape.values
            tape.write_states(new_states[envs])

        # An environment's result does not depend on the others in its part (up to rounding by BLAS).
        n_parts = max(1, min(len(self._memories), num_envs // _MIN_ENVS_PER_THREAD))
        bounds = [num_envs * i // n_parts for i in range(n_parts + 1)]
        self._pool.each(work, self._memories[:n_parts], (slice(*bound) for bound in pairwise(bounds)))
        return logits, values, new_states

    evaluate = step  # the default network has no evaluation mode

    def table(self) -> NDArray[np.float32]:
        """Return the current rows [R, H] of the encoder's table."""
        if self._numbers is None:
            return self._weights.encoder_weight
        table = np.zeros((self._n_table_rows, len(self._weights.encoder_bias)), np.float32)
        add_scaled_rows(*self._numbers, self._weights.encoder_weight, table)
        return table
