"""Test whether the lead of one of two methods grows with the difficulty of a goal graph."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from benchmarks.study.bootstrap import Bootstrap
from benchmarks.study.correlations import Estimate, interval, rank_correlations, resampled
from benchmarks.study.paired import Paired, ratios
from benchmarks.study.trained import medians

TRENDS = ("exit_depth", "width", "hitting_time", "play_expected_steps", "random_steps")
"""The measures with which the ratio is correlated; the last one that a table has says which graphs are the hardest."""


def trends(found: Paired, measures: Mapping[str, NDArray[np.float64]], bootstrap: Bootstrap) -> dict[str, Estimate]:
    """Spearman's correlation of the ratio of the two methods' median steps with measures, over the goal graphs.

    A graph on which neither method gets there has a ratio of 1. Intervals are as in `benchmarks.study.correlations`.

    Args:
        found: the two methods; those with a single seed have no interval.
        measures: by name, [G] of the same graphs; of these the ones in `TRENDS`.
        bootstrap: how intervals are computed.
    """
    chosen = {name: measures[name] for name in TRENDS if name in measures}
    if not chosen:
        return {}
    columns, rng, n = np.column_stack([*chosen.values()]), np.random.default_rng(bootstrap.seed), len(found.graphs)

    def correlated(values: NDArray[np.float64], graphs: NDArray[np.int64]) -> NDArray[np.float64]:
        return rank_correlations(np.column_stack([values, columns[graphs]]))[0, 1:]

    here = correlated(found.ratios, np.arange(n))
    if found.has_single_seed.any():
        return {name: Estimate(value, np.nan, np.nan) for name, value in zip(chosen, here.tolist(), strict=True)}
    drawn = []
    for _ in range(bootstrap.resamples):
        graphs = rng.integers(n, size=n)
        first, second = (medians(resampled(steps[graphs], rng)) for steps in found.steps)
        drawn.append(correlated(ratios(first, second), graphs))
    by_measure = zip(chosen, here.tolist(), np.array(drawn).T.tolist(), strict=True)
    return {name: interval(value, resamples, bootstrap.level) for name, value, resamples in by_measure}


def sentence(found: Mapping[str, Estimate]) -> str:
    """Return the correlations in a sentence; nothing where there is none."""
    if not found:
        return ""
    return f"Rank correlation of the ratio with {', '.join(f'{name} {value}' for name, value in found.items())}."
