"""The scale of each number of an observation."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

MOST_RANGE = 1e4
"""Bounds further apart than this say nothing about the numbers between them."""
CLIP = 10.0
"""Scaled numbers are clipped to -10 to 10, as in Stable-Baselines3's VecNormalize."""
_LEAST_DEVIATION = 1e-6  # of numbers whose mean is 1; smaller ones are rounding errors


class RunningScale(nn.Module):
    r"""Scales D numbers, each on its own: :math:`y_d = \mathrm{clip}(a_d x_d - b_d, -10, 10)`.

    Plausible bounds become -1 and 1. Other numbers get mean 0 and deviation 1 by the statistics of all turns that were
    learned from (those of two samples are joined as by Chan, Golub & LeVeque 1979). Until then they stay as they are.
    """

    factor: Tensor  # [D] a
    shift: Tensor  # [D] b
    mean: Tensor  # [D] of the numbers so far
    square: Tensor  # [D] sum of squared distances from the mean
    count: Tensor  # [1] number of turns so far

    def __init__(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
        super().__init__()
        with np.errstate(over="ignore", invalid="ignore"):
            span = high - low
        self._is_bounded = (span > 0) & (span <= MOST_RANGE)
        span = np.where(self._is_bounded, span, 2)
        factor, zeros = 2 / span, torch.zeros(len(low), dtype=torch.float64)
        shift = np.where(self._is_bounded, factor * np.where(self._is_bounded, low, 0) + 1, 0)
        self.register_buffer("factor", torch.tensor(factor, dtype=torch.float32))
        self.register_buffer("shift", torch.tensor(shift, dtype=torch.float32))
        self.register_buffer("mean", zeros)
        self.register_buffer("square", zeros.clone())
        self.register_buffer("count", torch.zeros(1, dtype=torch.float64))

    def forward(self, numbers: Tensor) -> Tensor:
        """Return the scaled numbers [..., D]."""
        return (numbers * self.factor - self.shift).clamp(-CLIP, CLIP)

    def scaled(self, numbers: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the same as `forward` in NumPy."""
        return np.clip(numbers * self.factor.numpy() - self.shift.numpy(), -CLIP, CLIP)

    def learn(self, numbers: NDArray[np.floating]) -> None:
        """Add numbers [..., D] to the statistics."""
        new = numbers.reshape(-1, numbers.shape[-1]).astype(np.float64)
        mean = new.mean(0)
        self.add(len(new), mean, ((new - mean) ** 2).sum(0))

    def add(self, n: float, mean: NDArray[np.float64], square: NDArray[np.float64]) -> None:
        """Add n numbers with their mean [D] and the sum [D] of their squared distances from it."""
        old_mean, old_square, count = (one.cpu().numpy() for one in (self.mean, self.square, self.count))
        total, change = count + n, mean - old_mean
        square = old_square + square + change**2 * count * n / total
        mean = old_mean + change * n / total
        deviation = np.sqrt(square / total)
        varies = deviation > _LEAST_DEVIATION * np.abs(mean)
        factor = np.where(varies, 1 / np.where(varies, deviation, 1), 1)
        changed = {"mean": mean, "square": square, "count": total}
        for name, values in {"factor": factor, "shift": factor * mean}.items():
            changed[name] = np.where(self._is_bounded, getattr(self, name).cpu().numpy(), values)
        for name, values in changed.items():
            getattr(self, name).copy_(torch.from_numpy(values))

    @property
    def has_learned(self) -> bool:
        """Return whether every number has plausible bounds or statistics."""
        return bool(self._is_bounded.all() or self.count > 0)
