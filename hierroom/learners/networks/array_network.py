"""A recurrent actor-critic for observations that hold arrays: images, vectors and large discrete numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
from torch import Tensor, nn

from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic
from hierroom.learners.networks.encoder import FeatureEncoder, Vectors
from hierroom.learners.networks.pictures import BOUND, PictureEncoder, initialised
from hierroom.support.byte_array import ByteArray

_TORCH_TYPES = {"uint8": torch.uint8, "int32": torch.int32, "float32": torch.float32}


class ArrayActorCritic(RecurrentActorCritic):
    """`RecurrentActorCritic` with an encoder for each array of an observation, and one for the categories."""

    def __init__(self, space: AgentSpace, hidden_size: int, feature_vectors: Vectors = None) -> None:
        super().__init__(replace(space, cardinalities=(1,), arrays=()), hidden_size)
        self.encoder = ArrayEncoder(space, hidden_size, feature_vectors)


class ArrayEncoder(nn.Module):
    r"""ReLU of the sum of the encoded parts of an observation: :math:`\max(0, \sum_p E_p(x_p))`.

    A linear layer on concatenated parts is also such a sum. Categories have a `FeatureEncoder`; arrays have others:

    - pixels: three convolutions (those of Mnih et al. 2015, or smaller ones), of numbers scaled to 0 to 1;
    - symbols, small images of bytes: a learned row for each value of each channel, summed (as in BabyAI, Hui et al.
      2020), and three convolutions of 2 x 2;
    - numbers: two layers, of numbers scaled to -1 to 1 where their bounds are known, else of
      :math:`\mathrm{sign}(x) \log(1 + |x|)`;
    - ids: a learned row for each value, summed.
    """

    columns: Tensor

    def __init__(self, space: AgentSpace, hidden_size: int, feature_vectors: Vectors = None) -> None:
        super().__init__()
        self._places = [(start, start + array.n_bytes) for start, array in space.arrays]
        self._types = [_TORCH_TYPES[array.dtype.name] for _, array in space.arrays]
        is_category = np.ones(space.n_features, bool)
        for start, stop in self._places:
            is_category[start:stop] = False
        columns = np.flatnonzero(is_category).tolist()
        self.register_buffer("columns", torch.tensor(columns, dtype=torch.int64), persistent=False)
        self.categories = None
        if columns:
            vectors = None if feature_vectors is None else [feature_vectors[column] for column in columns]
            self.categories = FeatureEncoder([space.cardinalities[column] for column in columns], hidden_size, vectors)
        self.arrays = nn.ModuleList(_encoder_of(array, hidden_size) for _, array in space.arrays)

    def forward(self, features: Tensor) -> Tensor:
        """Encode observations [..., K] uint8 as [..., H] float, at least 0."""
        flat = features.reshape(-1, features.shape[-1])
        total = torch.zeros((), dtype=torch.float32, device=features.device)
        if self.categories is not None:
            total = total + self.categories.linear(flat[:, self.columns])
        for (start, stop), kind, encode in zip(self._places, self._types, self.arrays, strict=True):
            row = flat[:, start:stop].clone(memory_format=torch.contiguous_format)  # aligns the numbers
            total = total + encode(row.view(kind))
        return torch.relu(total).reshape(*features.shape[:-1], -1)


def _encoder_of(array: ByteArray, hidden_size: int) -> nn.Module:
    if array.kind == "ids":
        return _Ids(array, hidden_size)
    if array.kind == "numbers":
        return _Numbers(array, hidden_size)
    return PictureEncoder(replace(array, kind="symbols") if array.were_symbols else array, hidden_size)


class _Ids(nn.Module):
    """A learned row for each value of each number, summed."""

    offsets: Tensor

    def __init__(self, array: ByteArray, hidden_size: int) -> None:
        super().__init__()
        n_rows = array.n_numbers * array.n_values
        self.table = nn.Embedding(n_rows, hidden_size, dtype=torch.float32)
        nn.init.orthogonal_(self.table.weight, 2**0.5)
        offsets = torch.arange(array.n_numbers) * array.n_values
        self.register_buffer("offsets", offsets, persistent=False)

    def forward(self, ids: Tensor) -> Tensor:
        return self.table(ids.long() + self.offsets).sum(-2)


class _Numbers(nn.Module):
    def __init__(self, array: ByteArray, hidden_size: int) -> None:
        super().__init__()
        self._low, self._high = array.low, array.high
        self._is_bounded = -BOUND < array.low < array.high < BOUND
        self.layers = nn.Sequential(
            initialised(nn.Linear(array.n_numbers, hidden_size, dtype=torch.float32)),
            nn.ReLU(),
            initialised(nn.Linear(hidden_size, hidden_size, dtype=torch.float32)),
        )

    def forward(self, numbers: Tensor) -> Tensor:
        if self._is_bounded:
            return self.layers((numbers - self._low) * (2 / (self._high - self._low)) - 1)
        return self.layers(numbers.sign() * torch.log1p(numbers.abs()))
