"""A recurrent actor-critic for observations that hold arrays: images, vectors and large discrete numbers."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn

from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic
from hierroom.learners.networks.encoder import FeatureEncoder, Vectors, require_weights
from hierroom.support.byte_array import ByteArray

_TORCH_TYPES = {"uint8": torch.uint8, "int32": torch.int32, "float32": torch.float32}
_SYMBOL_SIZE, _CHANNELS = 16, (16, 32, 64)
_STRIDED = ((8, 4), (4, 2), (3, 1))
"""Kernels and strides of Mnih et al. (2015), for pictures of at least 36 pixels a side."""
_CLOSE = ((3, 2), (3, 2), (3, 1))
_SMALL = ((2, 1), (2, 1), (2, 1))
_BOUND = 1e6
"""Arrays with bounds of at least this size count as unbounded."""


class ArrayActorCritic(RecurrentActorCritic):
    """`RecurrentActorCritic` with an encoder for each array of an observation, and one for the categories."""

    def __init__(self, space: AgentSpace, hidden_size: int, feature_vectors: Vectors = None) -> None:
        super().__init__(AgentSpace((1,), space.n_actions), hidden_size)
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
    return _Image(array, hidden_size)


class _Ids(nn.Module):
    """A learned row for each value of each number, summed."""

    offsets: Tensor

    def __init__(self, array: ByteArray, hidden_size: int) -> None:
        super().__init__()
        n_rows = array.n_numbers * array.n_values
        require_weights(f"discrete numbers with {n_rows:,} values", n_rows, hidden_size)
        self.table = nn.Embedding(n_rows, hidden_size, dtype=torch.float32)
        nn.init.orthogonal_(self.table.weight, 2**0.5)
        offsets = torch.arange(array.n_numbers) * array.n_values
        self.register_buffer("offsets", offsets, persistent=False)

    def forward(self, ids: Tensor) -> Tensor:
        return self.table(ids.long() + self.offsets).sum(-2)


class _Numbers(nn.Module):
    def __init__(self, array: ByteArray, hidden_size: int) -> None:
        super().__init__()
        require_weights(f"an array of {array.n_numbers:,} numbers", array.n_numbers, hidden_size)
        self._low, self._high = array.low, array.high
        self._is_bounded = -_BOUND < array.low < array.high < _BOUND
        self.layers = nn.Sequential(
            _initialised(nn.Linear(array.n_numbers, hidden_size, dtype=torch.float32)),
            nn.ReLU(),
            _initialised(nn.Linear(hidden_size, hidden_size, dtype=torch.float32)),
        )

    def forward(self, numbers: Tensor) -> Tensor:
        if self._is_bounded:
            return self.layers((numbers - self._low) * (2 / (self._high - self._low)) - 1)
        return self.layers(numbers.sign() * torch.log1p(numbers.abs()))


class _Image(nn.Module):
    """Convolutions, and a linear layer on their outputs."""

    offsets: Tensor

    def __init__(self, array: ByteArray, hidden_size: int) -> None:
        super().__init__()
        self._shape, self._low, self._high = array.shape, array.low, array.high
        height, width, channels = array.shape
        is_symbols = array.kind == "symbols"
        self.symbols = nn.Embedding(256 * channels, _SYMBOL_SIZE, dtype=torch.float32) if is_symbols else None
        self.register_buffer("offsets", torch.arange(channels) * 256, persistent=False)
        layers, sizes = [], (_SYMBOL_SIZE if is_symbols else channels, *_CHANNELS)
        kernels = _kernels(height, width, is_symbols)
        for (inputs, outputs), (kernel, stride) in zip(pairwise(sizes), kernels, strict=False):
            layers += [_initialised(nn.Conv2d(inputs, outputs, kernel, stride, dtype=torch.float32)), nn.ReLU()]
            height, width = (height - kernel) // stride + 1, (width - kernel) // stride + 1
        n_numbers = sizes[len(layers) // 2] * height * width
        require_weights(f"an image of shape {self._shape}", n_numbers, hidden_size)
        last = _initialised(nn.Linear(n_numbers, hidden_size, dtype=torch.float32))
        self.layers = nn.Sequential(*layers, nn.Flatten(), last)

    def forward(self, numbers: Tensor) -> Tensor:
        image = numbers.reshape(-1, *self._shape)
        if self.symbols is not None:
            image = self.symbols(image.long() + self.offsets).sum(-2)
        elif -_BOUND < self._low < self._high < _BOUND:
            image = (image.float() - self._low) / (self._high - self._low)
        else:
            image = image.sign() * torch.log1p(image.abs())
        return self.layers(image.permute(0, 3, 1, 2))


def _kernels(height: int, width: int, is_symbols: bool) -> Iterator[tuple[int, int]]:
    smallest = min(height, width)
    for kernel, stride in _SMALL if is_symbols or smallest < 16 else _STRIDED if smallest >= 36 else _CLOSE:
        if smallest < kernel:
            return
        yield kernel, stride
        smallest = (smallest - kernel) // stride + 1


def _initialised(layer: nn.Linear | nn.Conv2d) -> nn.Module:
    nn.init.orthogonal_(layer.weight, 2**0.5)
    assert layer.bias is not None
    nn.init.zeros_(layer.bias)
    return layer
