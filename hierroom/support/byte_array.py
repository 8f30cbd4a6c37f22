"""Arrays of any shape and type as rows of bytes, so that they fit into observations with features of one byte each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class ByteArray:
    """The layout of an array in a row of bytes.

    Args:
        shape: the shape of the array.
        kind: ``pixels`` (uint8 or float32, of shape height, width, channels), ``symbols`` (uint8, in the same shape),
            ``numbers`` (float32) or ``ids`` (int32, each below ``n_values``).
        low: the smallest value; -inf if unknown.
        high: the largest value; inf if unknown.
        n_values: the number of values of ids and symbols that a network tells apart; larger ones count as the last.
        were_symbols: whether networks of earlier versions read them as symbols, because the picture is small.
        bounds: the smallest values of the numbers, and the largest ones, n_numbers each; empty: ``low`` and ``high``.
    """

    shape: tuple[int, ...]
    kind: Literal["pixels", "symbols", "numbers", "ids"]
    low: float = -math.inf
    high: float = math.inf
    n_values: int = 256
    were_symbols: bool = False
    bounds: tuple[Sequence[float], Sequence[float]] | tuple[()] = ()

    @property
    def dtype(self) -> np.dtype:
        """The type of the array's numbers."""
        is_byte = self.kind == "symbols" or (self.kind == "pixels" and (self.low, self.high) == (0, 255))
        return np.dtype(np.uint8 if is_byte else np.int32 if self.kind == "ids" else np.float32)

    @property
    def n_numbers(self) -> int:
        """Number of entries of the array."""
        return math.prod(self.shape)

    @property
    def number_bounds(self) -> tuple[Sequence[float], Sequence[float]]:
        """The smallest and the largest value of each entry."""
        return self.bounds or ([self.low] * self.n_numbers, [self.high] * self.n_numbers)

    @property
    def n_bytes(self) -> int:
        """Number of bytes of a row."""
        return self.n_numbers * self.dtype.itemsize

    def to_bytes(self, values: NDArray) -> NDArray[np.uint8]:
        """Return arrays [M, ...] as rows of bytes [M, B]."""
        numbers = np.ascontiguousarray(values.reshape(len(values), -1), self.dtype)
        return numbers.view(np.uint8).reshape(len(values), -1)

    def examples(self, n: int) -> NDArray[np.uint8]:
        """Return n rows of bytes [n, B] with values from the smallest to the largest, to try out a network."""
        high = self.n_values - 1 if self.kind == "ids" else min(self.high, 255.0)
        ends = (max(self.low, -1.0), high) if self.kind == "numbers" else (0, high)
        return self.to_bytes(np.linspace(*ends, n).repeat(self.n_numbers).reshape(n, -1))
