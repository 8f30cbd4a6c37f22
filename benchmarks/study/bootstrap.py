"""Settings of the intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import InputError, require_number


@dataclass(frozen=True)
class Bootstrap:
    """Resamples of what was trained, and the part of them that an interval holds.

    Args:
        resamples: number of resamples, at least 2.
        level: confidence level of the intervals, above 0 and below 1.
        seed: of the resamples.

    Raises:
        InputError: if there are too few resamples, or the level is out of range.
    """

    resamples: int = 2000
    level: float = 0.95
    seed: int = 0

    def __post_init__(self) -> None:
        require_number("resamples", self.resamples, 2, 10**6, is_whole=True)
        if not 0 < self.level < 1:
            raise InputError(f"the level must be between 0 and 1, not {self.level}")

    def interval(self, drawn: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the ends of the middle part of resamples [R, ...], not interpolated, as they may be infinite."""
        low = np.quantile(drawn, (1 - self.level) / 2, axis=0, method="lower")
        return low, np.quantile(drawn, (1 + self.level) / 2, axis=0, method="higher")
