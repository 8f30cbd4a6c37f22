"""From an observation of small categories to a feature vector: the sum of one row per column."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor, nn
from torch.nn import functional

from hierroom.errors import InputError


class FeatureEncoder(nn.Module):
    r"""ReLU of the bias plus one row of a table per column: :math:`x = \max(0, b + \sum_k W_{k, c_k})`.

    It equals a linear layer on the concatenated one-hot columns, at the price of K row sums instead of a product with
    as many inputs as all columns have values together.

    A column can instead be fed as fixed numbers (as the paper feeds MiniGrid's object, colour and state ids): its
    rows are then ``vectors @ weights`` with a learned weight per number, so that what follows is the same.

    Args:
        cardinalities: number of values of each of the K columns.
        hidden_size: features H.
        feature_vectors: None, or for each column None (a learned row per value) or a [cardinality, d] array of the d
            numbers that stand for each value.

    Raises:
        InputError: if ``feature_vectors`` does not fit ``cardinalities``.
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
        # Small rows at first: scaled up to give the sum unit variance (rows are sparse: about 4 times larger), the
        # same agent needed half as many steps again on graphs c and g.
        nn.init.orthogonal_(self.weight, math.sqrt(2.0))

    def table(self) -> Tensor:
        """The rows of all columns, one below the other: [sum of cardinalities, H]."""
        return self.weight if self.inputs is None else self.inputs @ self.weight

    def forward(self, features: Tensor) -> Tensor:
        """Features of observations.

        Args:
            features: [..., K] uint8, each below its column's cardinality.

        Returns:
            [..., H] float, at least 0.
        """
        rows = features.long() + self.offsets
        flat = rows.reshape(-1, rows.shape[-1])  # [N, K]
        total = functional.embedding_bag(flat, self.table(), mode="sum") + self.bias
        return torch.relu(total).reshape(*features.shape[:-1], -1)


def _input_matrix(cardinalities: Sequence[int], feature_vectors: Sequence[ArrayLike | None]) -> Tensor:
    """Block-diagonal [sum of cardinalities, D]: the numbers that stand for each value of each column."""
    if len(feature_vectors) != len(cardinalities):
        raise InputError(f"there are {len(cardinalities)} columns but vectors for {len(feature_vectors)}")
    blocks = []
    for column, (cardinality, vectors) in enumerate(zip(cardinalities, feature_vectors, strict=True)):
        block = np.eye(cardinality) if vectors is None else np.asarray(vectors, np.float64)
        if block.ndim != 2 or len(block) != cardinality:
            raise InputError(
                f"column {column} has {cardinality} values, so its vectors are [{cardinality}, d], "
                f"not {list(block.shape)}"
            )
        blocks.append(torch.as_tensor(block, dtype=torch.float32))
    return torch.block_diag(*blocks)
