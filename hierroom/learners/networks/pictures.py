"""Encoders of pictures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn

from hierroom.support.byte_array import ByteArray

BOUND = 1e6
"""Arrays with bounds of at least this size count as unbounded."""
PICTURE_SIZES = {"nature": 512, "impala": 256}
"""Outputs of the published networks; ``small`` has as many as the network that it is a part of."""
_CHANNELS = {"small": (16, 32, 64), "nature": (32, 64, 64)}
_RESIDUAL_CHANNELS = (16, 32, 32)
_SYMBOL_SIZE = 16
_STRIDED = ((8, 4), (4, 2), (3, 1))
"""Kernels and strides of Mnih et al. (2015), for pictures of at least 36 pixels a side."""
_CLOSE = ((3, 2), (3, 2), (3, 1))
_SMALL = ((2, 1), (2, 1), (2, 1))


class PictureEncoder(nn.Module):
    """Convolutions, and a linear layer on their outputs.

    ``small`` has 16, 32 and 64 channels. ``nature`` is the network of Mnih et al. (2015) with 32, 64 and 64, ``impala``
    the residual network of Espeholt et al. (2018, figure 3) with 16, 32 and 32.
    """

    offsets: Tensor

    def __init__(self, array: ByteArray, size: int, network: str = "small") -> None:
        super().__init__()
        self._shape, self._low, self._high = array.shape, array.low, array.high
        height, width, channels = array.shape
        is_symbols = array.kind == "symbols"
        self.symbols = nn.Embedding(256 * channels, _SYMBOL_SIZE, dtype=torch.float32) if is_symbols else None
        self.register_buffer("offsets", torch.arange(channels) * 256, persistent=False)
        inputs = _SYMBOL_SIZE if is_symbols else channels
        kernels = _kernels(height, width, is_symbols)
        convolutions = _residual(inputs) if network == "impala" else _strided(inputs, _CHANNELS[network], kernels)
        with torch.no_grad():
            n_numbers = nn.Sequential(*convolutions)(torch.zeros(1, inputs, height, width, dtype=torch.float32)).numel()
        last = initialised(nn.Linear(n_numbers, size, dtype=torch.float32))
        self.layers = nn.Sequential(*convolutions, nn.Flatten(), last)

    def forward(self, numbers: Tensor) -> Tensor:
        """Return the outputs [N, size] for the numbers of N pictures."""
        image = numbers.reshape(-1, *self._shape)
        if self.symbols is not None:
            image = self.symbols(image.long() + self.offsets).sum(-2)
        elif -BOUND < self._low < self._high < BOUND:
            # In place, because new memory for many frames takes longer than the arithmetic.
            image = image.to(torch.float32, copy=True).sub_(self._low).div_(self._high - self._low)
        else:
            image = image.sign() * torch.log1p(image.abs())
        return self.layers(image.permute(0, 3, 1, 2))


def _strided(inputs: int, channels: Sequence[int], kernels: Iterable[tuple[int, int]]) -> list[nn.Module]:
    layers = []
    for (before, after), (kernel, stride) in zip(pairwise((inputs, *channels)), kernels, strict=False):
        layers += [initialised(nn.Conv2d(before, after, kernel, stride, dtype=torch.float32)), nn.ReLU(inplace=True)]
    return layers


def _residual(inputs: int) -> list[nn.Module]:
    layers: list[nn.Module] = []
    for before, after in pairwise((inputs, *_RESIDUAL_CHANNELS)):
        same = initialised(nn.Conv2d(before, after, 3, padding=1, dtype=torch.float32))
        layers += [same, nn.MaxPool2d(3, 2, padding=1), _Residual(after), _Residual(after)]
    return [*layers, nn.ReLU()]


class _Residual(nn.Module):
    def __init__(self, channels: int) -> None:
        super().__init__()
        convolutions = (initialised(nn.Conv2d(channels, channels, 3, padding=1, dtype=torch.float32)) for _ in "ab")
        self.layers = nn.Sequential(*(layer for one in convolutions for layer in (nn.ReLU(), one)))

    def forward(self, image: Tensor) -> Tensor:
        return image + self.layers(image)


def _kernels(height: int, width: int, is_symbols: bool) -> Iterator[tuple[int, int]]:
    smallest = min(height, width)
    for kernel, stride in _SMALL if is_symbols or smallest < 16 else _STRIDED if smallest >= 36 else _CLOSE:
        if smallest < kernel:
            return
        yield kernel, stride
        smallest = (smallest - kernel) // stride + 1


def initialised(layer: nn.Linear | nn.Conv2d) -> nn.Module:
    """Return a layer with orthogonal weights of gain sqrt 2 and zero biases."""
    nn.init.orthogonal_(layer.weight, 2**0.5)
    assert layer.bias is not None
    nn.init.zeros_(layer.bias)
    return layer
