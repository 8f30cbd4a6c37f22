"""An encoder of categorical observations: one row of a table for each feature, summed."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor, nn
from torch.nn import functional

from hierroom.support.errors import InputError


class FeatureEncoder(nn.Module):
    r"""ReLU of the bias plus one table row per feature: :math:`x = \max(0, b + \sum_k W_{k, c_k})`.

    This equals a linear layer on the concatenated one-hot features, at the cost of K row additions.

    Args:
        cardinalities: number of values of each of the K features.
        hidden_size: number of outputs H.
        feature_vectors: for each feature None (a learned row per value) or a [cardinality, d] array of the d fixed
            numbers that represent each value, as the paper does with MiniGrid's ids. Its rows are then
            ``vectors @ weights`` with one learned row of weights per number. None: a learned row per value of each.
    """

    offsets: Tensor
    inputs: Tensor | None

    def __init__(
        self,
        cardinalities: Sequence[int],
        hidden_size: int,
        feature_vectors: Sequence[ArrayLike | None] | None = None,
    ) -> None:
        super().__init__()
        n_rows = sum(cardinalities)
        starts = np.cumsum([0, *cardinalities[:-1]])
        self.register_buffer("offsets", torch.as_tensor(starts, dtype=torch.int64), persistent=False)
        inputs = None if feature_vectors is None else _input_matrix(cardinalities, feature_vectors)
        self.register_buffer("inputs", inputs, persistent=False)
        n_inputs = n_rows if inputs is None else inputs.shape[1]
        self.weight = nn.Parameter(torch.empty(n_inputs, hidden_size))
        self.bias = nn.Parameter(torch.zeros(hidden_size))
        # The initial rows are small. With rows about 4 times as large, so that the sparse sum had unit variance, the
        # same agent needed 50% more steps on graphs c and g.
        nn.init.orthogonal_(self.weight, math.sqrt(2.0))

    def table(self) -> Tensor:
        """Return the stacked rows of all features: [sum of cardinalities, H]."""
        return self.weight if self.inputs is None else self.inputs @ self.weight

    def forward(self, features: Tensor) -> Tensor:
        """Encode observations [..., K] uint8, each below its cardinality, as [..., H] float, at least 0."""
        rows = features.long() + self.offsets
        flat = rows.reshape(-1, rows.shape[-1])  # [N, K]
        total = functional.embedding_bag(flat, self.table(), mode="sum") + self.bias
        return torch.relu(total).reshape(*features.shape[:-1], -1)


def _input_matrix(cardinalities: Sequence[int], feature_vectors: Sequence[ArrayLike | None]) -> Tensor:
    """Return the block-diagonal matrix [sum of cardinalities, D] of the vectors of all features."""
    if len(feature_vectors) != len(cardinalities):
        raise InputError(f"feature_vectors needs {len(cardinalities)} entries (features), not {len(feature_vectors)}")
    blocks = []
    for column, (cardinality, vectors) in enumerate(zip(cardinalities, feature_vectors, strict=True)):
        block = np.eye(cardinality) if vectors is None else np.asarray(vectors, np.float64)
        if block.ndim != 2 or len(block) != cardinality:
            raise InputError(
                f"feature {column} has {cardinality} values, so its vectors must have shape [{cardinality}, d], "
                f"not {list(block.shape)}"
            )
        blocks.append(torch.as_tensor(block, dtype=torch.float32))
    return torch.block_diag(*blocks)
