"""What is seen of play itself, without a chain: mean, deviation and reach of its episodes, with intervals.

- **Reach**: of E episodes k had escaped within t steps; the interval is Wilson's score interval (Wilson, 1927; Brown,
  Cai and DasGupta, 2001). It has a width even where nobody escaped, about 4 / E.
- **Times**: percentile intervals of the bootstrap over whole episodes (Efron and Tibshirani, 1993, chapter 13). Fewer
  than `FEWEST_EPISODES`, or resamples that do not differ, say nothing about an interval: there is none then.

They cover the value that the same player would have over all levels and all its random numbers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from hierroom.complexity.played.episodes import EpisodeCounts

FEWEST_EPISODES = 10
"""With fewer episodes an interval from resampling them is much too narrow, and none is given."""


class Interval(NamedTuple):
    """A value and its confidence interval; low and high are ``nan`` where there is none."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return "none" if np.isnan(self.low) else f"{self.low:.4g} to {self.high:.4g}"


def wilson_interval(share: float, n: int, level: float) -> Interval:
    """Wilson's score interval of a share of successes in n trials."""
    z = float(ndtri((1 + level) / 2))
    middle = (share + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(share * (1 - share) / n + z**2 / (4 * n**2))
    low = float(middle - half) if share > 0 else 0.0  # exactly, where rounding would give 1e-19
    return Interval(share, low, float(middle + half) if share < 1 else 1.0)


def percentile_interval(value: float, resampled: ArrayLike, n_episodes: int, level: float) -> Interval:
    """Percentile interval of resampled values; without low and high where it would mislead."""
    low, high = np.quantile(np.asarray(resampled), ((1 - level) / 2, (1 + level) / 2), method="inverted_cdf")
    if n_episodes < FEWEST_EPISODES or not low < high:
        return Interval(value, np.nan, np.nan)
    return Interval(value, float(low), float(high))


def observed_steps(counts: EpisodeCounts) -> float:
    """Mean number of steps from a start to the next exit over consecutive episodes; ``inf`` if none escaped."""
    n_escaped = int(counts.escaped.sum())
    steps = int(counts.lengths.sum()) + len(counts.lengths) - n_escaped
    return steps / n_escaped if n_escaped else float("inf")


def observed(
    counts: EpisodeCounts, times: tuple[int, ...], level: float, n_resamples: int, rng: np.random.Generator
) -> dict[str, Interval]:
    """Return `"expected_steps"` to the exit, their `"std"` and `"exit within N"`; ``nan`` for what was not observed."""
    n = len(counts.lengths)
    # One after the other: all at once are too large for the memory where there are many episodes.
    draws = (rng.multinomial(n, np.full(n, 1 / n)) for _ in range(n_resamples))
    weights = np.column_stack([counts.lengths + ~counts.escaped, counts.escaped])
    steps, escapes = np.array([drawn @ weights for drawn in draws]).T
    with np.errstate(divide="ignore"):
        means = steps / escapes
    passages = counts.passages()
    std, stds = np.nan, np.array([np.nan])
    if len(passages) > 1:
        std = float(passages.std(ddof=1))
        chosen = (rng.integers(len(passages), size=len(passages)) for _ in range(n_resamples))
        stds = np.array([passages[drawn].std(ddof=1) for drawn in chosen])
    found = {
        "expected_steps": percentile_interval(observed_steps(counts), means, n, level),
        "std": percentile_interval(std, stds, len(passages), level),
    }
    for t, share in zip(times, counts.reach(times).tolist(), strict=True):
        is_seen = not np.isnan(share)
        found[within(t)] = wilson_interval(share, n, level) if is_seen else Interval(share, np.nan, np.nan)
    return found


def within(t: int) -> str:
    """Name the probability to have escaped within t steps."""
    return f"exit within {t}"
