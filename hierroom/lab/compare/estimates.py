"""Estimates over few runs, with intervals (Agarwal et al. 2021, "Deep RL at the edge of the statistical precipice").

A stratum is an array of scores [R, K, Q]: R runs that were evaluated on the same K graphs, and Q scores of each run on
each graph. The stratified bootstrap resamples whole runs within their stratum, as only runs are independent. All
statistics accept more axes in front, for resamples.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Scores = NDArray[np.float64]
Strata = Sequence[Scores]

LEVEL = 0.95
_ENTRIES_AT_ONCE = 4_000_000  # scores in a batch of resamples


@dataclass(frozen=True)
class Estimate:
    """Estimates with their 95% intervals."""

    values: Scores  # [Q] from all runs; NaN if any run has no score
    lows: Scores  # [Q] lower ends; NaN if a stratum has a single run
    highs: Scores  # [Q] upper ends


def interquartile_mean(strata: Strata) -> Scores:
    """Return the mean [..., Q] of the middle half of all scores, without a quarter (rounded down) at each end."""
    return stats.trim_mean(_pooled(strata), 0.25, axis=-2)


def mean(strata: Strata) -> Scores:
    """Return the mean [..., Q] of all scores."""
    return _pooled(strata).mean(axis=-2)


def probability_of_improvement(ours: Sequence[Scores], theirs: Sequence[Scores]) -> Scores:
    """Return the probability [..., Q] that a run of ours scores higher than one of theirs, averaged over the graphs.

    ``P(X > Y) = mean over graphs g of mean over pairs (i, j) of [x[g, i] > y[g, j]] + [x[g, i] = y[g, j]] / 2``
    (Agarwal et al. 2021, section 4.3; Mann & Whitney 1947), with scores [..., R, Q] and [..., S, Q] for each graph.
    """
    by_graph = []
    for x, y in zip(ours, theirs, strict=True):
        x, y = x[..., :, None, :], y[..., None, :, :]  # [..., R, S, Q]
        by_graph.append((x > y).mean(axis=(-3, -2)) + (x == y).mean(axis=(-3, -2)) / 2)
    return np.mean(by_graph, axis=0)


def estimate(strata: Strata, statistic: Callable[[Strata], Scores], resamples: int, seed: int) -> Estimate:
    """Return a statistic of strata [R, K, Q] to [Q], with the 2.5% and 97.5% quantiles of its stratified bootstrap."""
    values = statistic(strata)
    unknown = np.full_like(values, np.nan)
    is_known = np.isfinite(_pooled(strata)).all(axis=-2)
    values = np.where(is_known, values, np.nan)
    if min(map(len, strata)) < 2 or not is_known.any():
        return Estimate(values, unknown, unknown)
    known = [stratum[..., is_known] for stratum in strata]

    def resampled(*runs: NDArray[np.int64], axis: int) -> Scores:
        """Return the statistic [Q, B] of B samples [B, R] of the runs of each stratum."""
        return statistic([stratum[sample] for stratum, sample in zip(known, runs, strict=True)]).T

    result = stats.bootstrap(
        [np.arange(len(stratum)) for stratum in known],
        resampled,
        n_resamples=resamples,
        batch=max(1, _ENTRIES_AT_ONCE // sum(stratum.size for stratum in known)),
        vectorized=True,
        confidence_level=LEVEL,
        method="percentile",
        rng=np.random.default_rng(seed),
    )
    lows, highs = unknown.copy(), unknown.copy()
    lows[is_known], highs[is_known] = result.confidence_interval
    return Estimate(values, lows, highs)


def _pooled(strata: Strata) -> Scores:
    return np.concatenate([s.reshape(*s.shape[:-3], -1, s.shape[-1]) for s in strata], axis=-2)
