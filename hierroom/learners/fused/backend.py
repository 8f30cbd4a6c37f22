"""The learner's arithmetic in compiled kernels: the CPU counterpart of `TorchBackend` for the default network.

Shards of sequences, their workers and the order in which gradients are added are fixed. So the result does not depend
on the number of threads.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from hierroom.learners.config import PPOConfig
from hierroom.learners.fused.adam_kernels import adam_step, norm, norm_of_blocks, sum_gradients
from hierroom.learners.fused.encoder_kernels import compare_rows, most_common, rare_rows
from hierroom.learners.fused.network import FusedNetwork, Inputs, Parameters
from hierroom.learners.fused.shard_worker import Minibatch, ShardWorker, fixed_numbers
from hierroom.learners.fused.stepper import FusedStepper
from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic
from hierroom.learners.networks.feed_forward import FeedForwardActorCritic, ScaledActorCritic
from hierroom.learners.networks.input_layer import InputLayer
from hierroom.learners.rollout import Batch
from hierroom.support.thread_pool import ThreadPool

_SHARD = 16  # sequences per shard: 16 of 128 turns fit the last-level cache; fewer make matrix products too small
_SHARD_OF_TURNS = 256  # turns per shard of a network without memory
_MAX_WORKERS = 8
_BLOCK = 16  # table rows; with fewer, kernels take longer where all rows have gradients


def can_fuse(network: nn.Module, space: AgentSpace) -> bool:
    """Return whether compiled kernels can train a network. Its type must be exact: a subclass may compute else."""
    if space.kind != "discrete" or type(network) not in (
        RecurrentActorCritic,
        ScaledActorCritic,
        FeedForwardActorCritic,
    ):
        return False
    layer = network.encoder
    return not isinstance(layer, InputLayer) or not layer.layout.pictures


class FusedBackend:
    """Forward passes, loss, gradients and Adam in Numba; the network's parameters become views of one flat vector."""

    def __init__(self, network: FusedNetwork, config: PPOConfig, threads: int) -> None:
        self._network = network
        self._config = config
        self._pool = ThreadPool(threads)
        self._parameters = np.concatenate([p.detach().numpy().ravel() for p in network.parameters()])
        self._weights = Parameters.views(self._parameters, network)
        self._inputs = Inputs.of(network)
        views = dict(vars(self._weights))
        if self._inputs.layer is None:
            del views["number_weight"]
        for parameter, view in zip(network.parameters(), views.values(), strict=True):
            parameter.data = torch.from_numpy(view)
        self._offsets = self._inputs.codes.offsets.numpy()
        self._used = np.zeros(len(self._inputs.codes.table()), np.bool_)  # table rows that had a gradient
        self._numbers = fixed_numbers(self._inputs.codes)
        self._shard = _SHARD if config.memory == "lstm" else _SHARD_OF_TURNS
        self._means = np.zeros_like(self._parameters)
        self._squares = np.zeros_like(self._parameters)
        self._n_steps = 0
        self._shares = np.zeros((_MAX_WORKERS, len(self._parameters)), np.float32)
        self._workers = [ShardWorker(share, network, config) for share in self._shares]
        self._stepper = self.stepper()
        self.initial_states = self._stepper.initial_states
        self.step = self.evaluate = self._stepper.step  # the default network has no evaluation mode

    def __getstate__(self) -> dict:
        """Return arguments and state to build a copy, because its weights must be views of its own vector."""
        return {"arguments": (self._network, self._config, self._pool.threads), "state": self.state_dict()}

    def __setstate__(self, copied: dict) -> None:
        self.__init__(*copied["arguments"])
        self.load_state_dict(copied["state"])

    def stepper(self) -> FusedStepper:
        """Return a stepper for the turns of one policy with the current weights."""
        return FusedStepper(self._network, self._weights, self._numbers, self._pool)

    def train(
        self,
        batch: Batch,
        advantages: NDArray[np.float32],
        importance_weights: NDArray[np.float32],
        minibatches: Iterable[NDArray[np.integer]],
        learning_rate: float,
    ) -> NDArray[np.float64]:
        """Take one gradient step per minibatch; see `TorchBackend.train`."""
        targets = advantages + batch.values
        # Every 16th turn is enough to find the most common value of each feature.
        codes, numbers = self._inputs.read(batch.features)
        common = most_common(codes[::16].reshape(-1, codes.shape[-1]))
        rows, counts = rare_rows(codes, self._offsets, common, self._used)
        occurring, blocks = np.flatnonzero(self._used), self._blocks()
        differences = np.empty((len(self._used) + 1, len(self._weights.encoder_bias)), np.float32)
        base = np.empty_like(self._weights.encoder_bias)
        measured = []
        for part in minibatches:
            places = self._offsets, common, occurring
            compare_rows(self._stepper.table(), self._weights.encoder_bias, *places, differences, base)
            shift, scale = np.float32(0), np.float32(1)
            if self._config.normalize_advantages:  # as `torch_backend.normalized`
                chosen = advantages.take(part, axis=1)
                shift, scale = chosen.mean(), np.float32(1 / max(chosen.std(), self._config.min_advantage_std))
            scores = (advantages - shift) * scale * importance_weights
            encoding = differences, base, *places, blocks, rows, counts, numbers
            turn_weight = 1 / (len(advantages) * len(part))
            minibatch = Minibatch(self._weights, *encoding, batch, scores, targets, turn_weight)
            statistics, norm = self._gradient(minibatch, part)
            measured.append([*statistics, norm])
            self._n_steps += 1
            clipped = min(1.0, self._config.max_gradient_norm / (norm + 1e-6))  # as torch's clip_grad_norm_
            settings = blocks, clipped, learning_rate, self._config.adam_epsilon, self._n_steps
            adam_step(self._parameters, self._shares[0], self._means, self._squares, *settings)
        return np.mean(measured, axis=0)

    def _gradient(self, minibatch: Minibatch, part: NDArray[np.integer]) -> tuple[NDArray[np.float64], float]:
        """Write the gradient to the first row of the shares; return the first five `STATISTICS` and its norm."""
        shards = np.array_split(part, -(-len(part) // self._shard))
        workers = self._workers[: len(shards)]

        def work(worker: ShardWorker, hand: list[NDArray[np.integer]]) -> NDArray[np.float64]:
            worker.clear(minibatch)
            for shard in hand:
                worker.add_shard(minibatch, shard)
            return worker.finish(minibatch)

        hands = [shards[first :: len(workers)] for first in range(len(workers))]
        statistics = np.sum(self._pool.each(work, workers, hands), axis=0)
        sum_gradients(self._shares[: len(workers)], minibatch.blocks)
        # A sum over blocks rounds differently, so runs on categories alone keep the sum over all rows.
        is_old = self._inputs.layer is None
        total = self._shares[0]
        return statistics, norm(total) if is_old else norm_of_blocks(total, minibatch.blocks)

    def _blocks(self) -> NDArray[np.int64]:
        """Return first index and stop [B, 2] of the blocks of parameters that had a gradient."""
        if self._numbers is not None:
            return np.array([[0, len(self._parameters)]])
        table_size = self._weights.encoder_weight.size
        first_rows = np.arange(0, len(self._used), _BLOCK)
        width = len(self._weights.encoder_bias)
        starts = first_rows[np.logical_or.reduceat(self._used, first_rows)] * width
        stops = np.minimum(starts + _BLOCK * width, table_size)
        return np.stack([np.append(starts, table_size), np.append(stops, len(self._parameters))], axis=1)

    def state_dict(self) -> dict:
        """Return copies of the weights and of Adam's moments."""
        return {
            "network": {name: tensor.clone() for name, tensor in self._network.state_dict().items()},
            "means": torch.from_numpy(self._means.copy()),
            "squares": torch.from_numpy(self._squares.copy()),
            "n_steps": self._n_steps,
        }

    def load_state_dict(self, state: dict) -> None:
        """Restore what `state_dict` returned."""
        self._network.load_state_dict(state["network"])
        self._means[...] = state["means"].numpy()
        self._squares[...] = state["squares"].numpy()
        self._n_steps = state["n_steps"]
        self._shares[...] = 0
        if self._numbers is None:
            tables = [Parameters.views(m, self._network).encoder_weight for m in (self._means, self._squares)]
            self._used[...] = np.any(tables, axis=(0, 2))
