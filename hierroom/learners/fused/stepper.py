"""Forward passes of one turn in compiled kernels, with their own memory."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from hierroom.learners.fused.encoder_kernels import add_scaled_rows, encode
from hierroom.learners.fused.network import Parameters, TapeMemory, forward
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
        network: RecurrentActorCritic,
        weights: Parameters,
        numbers: tuple[NDArray, NDArray, NDArray] | None,
        pool: ThreadPool,
    ) -> None:
        self._network, self._weights, self._numbers, self._pool = network, weights, numbers, pool
        self._offsets = network.encoder.offsets.numpy()
        self._n_table_rows = len(network.encoder.table())
        self._memories = [TapeMemory(weights) for _ in range(min(pool.threads, MAX_PARTS))]

    def initial_states(self, n: int) -> NDArray[np.float32]:
        """Return the recurrent states [n, S] at the start of an episode."""
        return self._network.initial_state(n).numpy()

    def step(self, features: NDArray[np.uint8], states: NDArray[np.float32]) -> tuple[NDArray, NDArray, NDArray]:
        """Compute one turn; see `TorchBackend.step`."""
        num_envs, features = len(features), np.ascontiguousarray(features)
        logits = np.empty((num_envs, len(self._weights.policy_bias)), np.float32)
        values, new_states = np.empty(num_envs, np.float32), np.empty_like(states)
        table, hidden_size = self.table(), len(self._weights.encoder_bias)

        def work(memory: TapeMemory, envs: slice) -> None:
            n = envs.stop - envs.start
            tape = memory.tape(1, n)
            never = np.zeros((1, n), bool)
            encode(features[envs], self._offsets, table, self._weights.encoder_bias, tape.encoded)
            forward(self._weights, states[envs], never, tape)
            logits[envs], values[envs] = tape.logits, tape.values
            new_states[envs, :hidden_size], new_states[envs, hidden_size:] = tape.hidden[0], tape.cells[1]

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
