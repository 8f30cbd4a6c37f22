"""One linear layer on all parts of an observation: categories, symbols, ids, scaled numbers and pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.networks.encoder import FeatureEncoder, Vectors
from hierroom.learners.networks.pictures import PICTURE_SIZES, PictureEncoder
from hierroom.learners.networks.scale import RunningScale
from hierroom.support.byte_array import ByteArray

_TORCH_TYPES = {"uint8": torch.uint8, "int32": torch.int32, "float32": torch.float32}


@dataclass(frozen=True)
class InputLayout:
    """Find the parts of an observation in its K bytes.

    Codes are whole numbers that the network reads one-hot: categories, symbols and ids. Numbers are floats.
    """

    columns: tuple[int, ...]  # those of the categories
    codes: tuple[tuple[int, ByteArray], ...]  # symbols and ids, each after its first column
    numbers: tuple[tuple[int, ByteArray], ...]
    pictures: tuple[tuple[int, ByteArray], ...]
    cardinalities: tuple[int, ...]  # number of values of each of the C codes, at least one code

    @classmethod
    def of(cls, space: AgentSpace) -> InputLayout:
        """Return the layout of an agent's observations."""
        is_category = np.ones(space.n_features, bool)
        for start, array in space.arrays:
            is_category[start : start + array.n_bytes] = False
        columns = tuple(np.flatnonzero(is_category).tolist())
        kinds = (("symbols", "ids"), ("numbers",), ("pixels",))
        codes, numbers, pictures = (tuple(one for one in space.arrays if one[1].kind in kind) for kind in kinds)
        cardinalities = [space.cardinalities[column] for column in columns]
        cardinalities += [array.n_values for _, array in codes for _ in range(array.n_numbers)]
        return cls(columns, codes, numbers, pictures, tuple(cardinalities) or (1,))

    @property
    def is_categorical(self) -> bool:
        """Return whether each of the K bytes is a category."""
        return not (self.codes or self.numbers or self.pictures)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Return the bounds [2, D] of the D numbers."""
        both = [np.reshape(array.number_bounds, (2, -1)) for _, array in self.numbers]
        return np.concatenate([np.zeros((2, 0)), *both], axis=1)

    def read_codes(self, features: NDArray[np.uint8]) -> NDArray[np.uint8 | np.int32]:
        """Return the codes [..., C] in observations [..., K]."""
        if self.is_categorical:
            return features
        categories = features[..., self.columns] if self.columns or self.codes else np.zeros_like(features[..., :1])
        codes = (np.minimum(_read(features, start, one), one.n_values - 1) for start, one in self.codes)
        return np.concatenate([categories, *codes], axis=-1)

    def read_numbers(self, features: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return the numbers [..., D] in observations [..., K]."""
        return np.concatenate([np.zeros((*features.shape[:-1], 0), np.float32), *self.arrays_of(features)], axis=-1)

    def arrays_of(self, features: NDArray[np.uint8]) -> list[NDArray[np.float32]]:
        """Return the arrays of numbers [..., d] in observations [..., K]."""
        return [_read(features, *one) for one in self.numbers]


def _read(features: NDArray[np.uint8], start: int, array: ByteArray) -> NDArray:
    return np.ascontiguousarray(features[..., start : start + array.n_bytes]).view(array.dtype)


class InputLayer(nn.Module):
    r"""The first layer: :math:`b + \sum_k W_{k, c_k} + V y + P z` of codes c, scaled numbers y and encoded pictures z.

    Args:
        space: the agent's observations.
        hidden_size: outputs H of each trunk, which are initialised orthogonally.
        vectors: fixed numbers for values of categories, see `FeatureEncoder`.
        trunks: number of parts of the outputs.
        pictures: name of the `PictureEncoder`.
        scaled: whether each number has a scale of its own.
    """

    def __init__(
        self,
        space: AgentSpace,
        hidden_size: int,
        vectors: Vectors,
        *,
        trunks: int = 1,
        pictures: str = "small",
        scaled: bool = False,
    ) -> None:
        super().__init__()
        self.layout = layout = InputLayout.of(space)
        n_numbers = layout.bounds.shape[1]
        size, inputs = trunks * hidden_size, PICTURE_SIZES.get(pictures, hidden_size)
        self.codes = FeatureEncoder(layout.cardinalities, size, self._of_codes(vectors))
        self.numbers = _Product(n_numbers, size)
        self.scale = RunningScale(*layout.bounds) if n_numbers and scaled else None
        self.pictures = nn.ModuleList(PictureEncoder(array, inputs, pictures) for _, array in layout.pictures)
        self.of_pictures = _Product(inputs * len(layout.pictures), size) if layout.pictures else None
        with torch.no_grad():
            for part in filter(None, (self.codes, self.numbers, self.of_pictures)):
                for trunk in part.weight.split(hidden_size, dim=1):
                    nn.init.orthogonal_(trunk, 2**0.5)

    def _of_codes(self, vectors: Vectors) -> Vectors:
        if vectors is None:
            return None
        of_categories = [vectors[column] for column in self.layout.columns]
        return [*of_categories, *[None] * (len(self.layout.cardinalities) - len(of_categories))]

    def forward(self, features: Tensor) -> Tensor:
        """Return the outputs [..., trunks H] float for observations [..., K] uint8."""
        flat, layout = features.reshape(-1, features.shape[-1]), self.layout
        of_arrays = (_view(flat, *one).long().clamp(max=one[1].n_values - 1) for one in layout.codes)
        codes = [flat[:, list(layout.columns)].long(), *of_arrays]
        if not (layout.columns or layout.codes):
            codes = [torch.zeros_like(flat[:, :1]).long()]
        total = self.codes.linear(torch.cat(codes, 1))
        if layout.numbers:
            numbers = torch.cat([_view(flat, *one) for one in layout.numbers], 1)
            total = total + self.numbers(numbers if self.scale is None else self.scale(numbers))
        if self.of_pictures is not None:
            encoded = [encode(_view(flat, *one)) for one, encode in zip(layout.pictures, self.pictures, strict=True)]
            total = total + self.of_pictures(torch.relu(torch.cat(encoded, 1)))
        return total.reshape(*features.shape[:-1], -1)

    def read_numbers(self, features: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return the scaled numbers [..., D] of observations [..., K] in NumPy."""
        numbers = self.layout.read_numbers(features)
        return numbers if self.scale is None else self.scale.scaled(numbers)

    def learn(self, features: NDArray[np.uint8]) -> None:
        """Add the numbers of observations [..., K] to the statistics of their scales."""
        if self.scale is not None:
            self.scale.learn(self.layout.read_numbers(features))

    def outside(self, features: NDArray[np.uint8]) -> tuple[int, float] | None:
        """Return the first column of an array, and its number that leaves its bounds, in observations [..., K]."""
        for (start, array), numbers in zip(self.layout.numbers, self.layout.arrays_of(features), strict=True):
            low, high = np.reshape(array.number_bounds, (2, -1)).astype(np.float32)
            is_outside = (numbers < low) | (numbers > high)
            if is_outside.any():
                return start, float(numbers[is_outside][0])
        return None

    @property
    def has_scales(self) -> bool:
        """Return whether the scales are known."""
        return self.scale is None or self.scale.has_learned


def reads_pictures(network: nn.Module) -> bool:
    """Return whether a network has an `InputLayer` with encoders of pictures."""
    layer = getattr(network, "encoder", None)
    return isinstance(layer, InputLayer) and layer.of_pictures is not None


class RectifiedInputLayer(InputLayer):
    """An `InputLayer` with a ReLU."""

    def forward(self, features: Tensor) -> Tensor:
        """Return the outputs [..., H], at least 0."""
        return torch.relu(super().forward(features))


class _Product(nn.Module):
    """A linear layer without bias, whose weight is [inputs, outputs]."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.empty(inputs, outputs, dtype=torch.float32))

    def forward(self, numbers: Tensor) -> Tensor:
        return numbers @ self.weight


def _view(features: Tensor, start: int, array: ByteArray) -> Tensor:
    row = features[:, start : start + array.n_bytes].clone(memory_format=torch.contiguous_format)  # aligns the numbers
    return row.view(_TORCH_TYPES[array.dtype.name])
