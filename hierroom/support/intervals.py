"""A value with its confidence interval, and Wilson's interval of a share (Wilson, 1927)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import ndtri


class Interval(NamedTuple):
    """A value and its confidence interval."""

    value: float
    low: float
    high: float


def wilson_interval(share: float, n: int, level: float) -> Interval:
    """Return Wilson's score interval for a share of successes in n trials (Brown, Cai and DasGupta, 2001)."""
    z = float(ndtri((1 + level) / 2))
    middle = (share + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(share * (1 - share) / n + z**2 / (4 * n**2))
    low = float(middle - half) if share > 0 else 0.0  # exactly, where rounding would give 1e-19
    return Interval(share, low, float(middle + half) if share < 1 else 1.0)
