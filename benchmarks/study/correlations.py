"""Rank correlations of measures with the difficulty of goal graphs, and how far seeds and graphs decide them.

With y the difficulty, x a measure, z the number of goals and r Spearman's rank correlation:

| statistic | what it is |
|---|---|
| `spearman` | r_xy |
| `kendall` | Kendall's tau-b (`scipy.stats.kendalltau`) |
| `given goals` | partial correlation (r_xy - r_xz r_yz) / sqrt((1 - r_xz^2) (1 - r_yz^2)) |
| `given exit depth` | the same with z the exit depth, where that is one of the measures |
| `at N goals` | r_xy over the graphs of N goals |
| `at fixed goals` | mean of these, each weighted by its number of graphs |
| `minus goals` | r_xy - r_zy: how much better than the plain count |
| `minus exit depth`, `minus hitting time` | the same against these, where they are among the measures |

Intervals are those of a hierarchical bootstrap: graphs are drawn with replacement, and of each graph drawn its seeds
(Davison and Hinkley, Bootstrap Methods and their Application, 1997, section 3.8). Drawing seeds of those that were
drawn doubles their noise, which lowers the correlations of all resamples; so the percentiles are moved by the
difference of the resamples' mean and the number itself. By `benchmarks/study/interval_coverage.py` they then hold the
truth about as often as they say, or more often. All measures are computed of the same resamples, so that a difference
is one of pairs. A graph on which half of the seeds or more never reached the milestone ranks last, and all of these
alike.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import kendalltau, rankdata

from benchmarks.study.bootstrap import Bootstrap
from benchmarks.study.trained import FEWEST_GRAPHS, Trained, medians

Table = dict[tuple[str, str], float]
"""A number for each measure and statistic: a correlation, -1 to 1, or the difference of two, -2 to 2."""
LEAST_SHARE = 0.9
"""Least share of resamples with a value for an interval; in the others the graphs are all alike."""


class Estimate(NamedTuple):
    """A number and its interval, ``nan`` where there is none."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        value, low, high = (f"{round(number, 2) + 0.0:.2f}" for number in self)  # no -0.00
        return "-" if np.isnan(self.value) else value if np.isnan(self.low) else f"{value} [{low}, {high}]"


def correlations(
    difficulty: NDArray[np.float64], measures: Mapping[str, NDArray[np.float64]], goals: NDArray[np.float64]
) -> Table:
    """Return every statistic of every measure; ``nan`` where it has none.

    Args:
        difficulty: [G], may hold ``inf``.
        measures: for each its values [G].
        goals: [G] the number of goals of each graph.
    """
    columns, names = np.column_stack([difficulty, goals, *measures.values()]), ["", "", *measures]
    ranked = rank_correlations(columns)
    with_difficulty, count = ranked[0], ranked[0, 1]
    table: Table = {}
    strata = [goals == n for n in np.unique(goals)]
    strata = [graphs for graphs in strata if graphs.sum() >= FEWEST_GRAPHS]
    fixed = [rank_correlations(columns[graphs])[0] for graphs in strata]
    depth, paper = (names.index(name) if name in names else None for name in ("exit_depth", "hitting_time"))
    for i, (name, values) in enumerate(measures.items(), start=2):
        r_xy = with_difficulty[i]
        table[name, "spearman"] = r_xy
        table[name, "kendall"] = float(kendalltau(values, difficulty).statistic)  # pyright: ignore[reportAttributeAccessIssue] - not in the stub
        table[name, "given goals"] = _given(ranked, i, 1)
        table[name, "given exit depth"] = np.nan if depth is None else _given(ranked, i, depth)
        table[name, "minus goals"] = r_xy - count
        table[name, "minus exit depth"] = np.nan if depth is None else r_xy - with_difficulty[depth]
        table[name, "minus hitting time"] = np.nan if paper is None else r_xy - with_difficulty[paper]
        own = [(row[i], int(graphs.sum())) for row, graphs in zip(fixed, strata, strict=True) if not np.isnan(row[i])]
        weight = sum(n for _, n in own)
        table[name, "at fixed goals"] = sum(r * n for r, n in own) / weight if own else np.nan
        for row, graphs in zip(fixed, strata, strict=True):
            table[name, f"at {goals[graphs][0]:.0f} goals"] = row[i]
    return table


def _given(ranked: NDArray[np.float64], x: int, z: int) -> float:
    """Return the partial correlation of column x and the difficulty, column 0, given column z."""
    r_xy, r_xz, r_yz = ranked[x, 0], ranked[x, z], ranked[0, z]
    left = (1 - r_xz**2) * (1 - r_yz**2)
    return (r_xy - r_xz * r_yz) / np.sqrt(left) if left > 1e-12 else np.nan


def estimates(
    trained: Trained,
    measures: Mapping[str, NDArray[np.float64]],
    goals: NDArray[np.float64],
    bootstrap: Bootstrap,
    progress: Callable[[int], object] = lambda done: None,
) -> dict[tuple[str, str], Estimate]:
    """Every statistic of every measure with its interval.

    Args:
        trained: the outcomes of one method.
        measures: for each its values [G].
        goals: [G] the number of goals of each graph.
        bootstrap: how intervals are computed.
        progress: called with the number of resamples done.
    """
    rng = np.random.default_rng(bootstrap.seed)
    tables = []
    for i in range(bootstrap.resamples):
        graphs = rng.integers(len(trained.graphs), size=len(trained.graphs))
        difficulty = medians(resampled(trained.outcomes[graphs], rng))
        drawn = {name: values[graphs] for name, values in measures.items()}
        tables.append(correlations(difficulty, drawn, goals[graphs]))
        progress(i + 1)
    found = correlations(medians(trained.outcomes), measures, goals)
    bounds = {key: 2.0 if key[1].startswith("minus") else 1.0 for key in found}
    return {
        key: interval(value, [table.get(key, np.nan) for table in tables], bootstrap.level, bounds[key])
        for key, value in found.items()
    }


def resampled(outcomes: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw the seeds of each graph with replacement [G, S], as many as it has, ``nan`` in the same places.

    Args:
        outcomes: [G, S] with ``nan`` at the end of a row for what is missing.
        rng: source of the draws.
    """
    n = (~np.isnan(outcomes)).sum(axis=1)[:, None]
    seeds = (rng.random(outcomes.shape) * n).astype(int)
    return np.where(np.isnan(outcomes), np.nan, np.take_along_axis(outcomes, seeds, axis=1))


def split_half(trained: Trained, bootstrap: Bootstrap) -> Estimate:
    """Split-half reliability: Spearman's correlation between the medians of two halves of the seeds.

    The value is the mean over random halves; the interval is over halves and graphs drawn with replacement.

    Args:
        trained: the outcomes of one method; ``nan`` is returned if a graph has an odd number of seeds, as their
            halves are of unequal size.
        bootstrap: how many random halves, and how the interval is computed.
    """
    if ((~np.isnan(trained.outcomes)).sum(axis=1) % 2).any():
        return Estimate(np.nan, np.nan, np.nan)
    rng, found, drawn = np.random.default_rng(bootstrap.seed), [], []
    for _ in range(bootstrap.resamples):
        order = rng.random(trained.outcomes.shape)
        order[np.isnan(trained.outcomes)] = 2  # missing ones stay at the end
        mixed = np.take_along_axis(trained.outcomes, order.argsort(axis=1), axis=1)
        pair = np.column_stack([medians(mixed[:, 0::2]), medians(mixed[:, 1::2])])
        graphs = rng.integers(len(pair), size=len(pair))
        found.append(rank_correlations(pair)[0, 1])
        drawn.append(rank_correlations(pair[graphs])[0, 1])
    return interval(float(np.nanmean(found)) if not np.isnan(found).all() else np.nan, drawn, bootstrap.level)


def ceiling(reliability: Estimate) -> Estimate:
    """Return the correlation that a measure would have if only the noise of the seeds kept it from 1.

    All seeds have the reliability R = 2 r / (1 + r), where halves of them have r (Spearman, Brown, 1910), and what is
    free of noise correlates with them by sqrt(R) (Spearman, 1904). It is 0 where r is not positive.

    Args:
        reliability: r with its interval, as `split_half` gives it.
    """
    r = np.maximum(reliability, 0.0)  # nan stays nan
    return Estimate(*map(float, np.sqrt(2 * r / (1 + r))))


def noise_of_twins(trained: Trained, bootstrap: Bootstrap) -> Estimate:
    """Spearman's correlation between goal graphs and their twins, which are the same but for the numbers of rooms.

    Args:
        trained: the outcomes of one method; ``nan`` is returned if fewer than four graphs have a twin.
        bootstrap: of the pairs, and of each over its seeds.
    """
    n, originals = len(trained.twins), trained.outcomes[trained.twins]
    if n < FEWEST_GRAPHS:
        return Estimate(np.nan, np.nan, np.nan)
    rng, drawn = np.random.default_rng(bootstrap.seed), []
    for _ in range(bootstrap.resamples):
        pairs = rng.integers(n, size=n)
        both = [medians(resampled(outcomes[pairs], rng)) for outcomes in (originals, trained.twin_outcomes)]
        drawn.append(rank_correlations(np.column_stack(both))[0, 1])
    both = np.column_stack([medians(originals), medians(trained.twin_outcomes)])
    return interval(float(rank_correlations(both)[0, 1]), drawn, bootstrap.level)


def twin_factor(trained: Trained) -> float:
    """By which factor a goal graph and its twin differ: the median over pairs; ``nan`` if no pair has two numbers."""
    pairs = np.column_stack([medians(trained.outcomes[trained.twins]), medians(trained.twin_outcomes)])
    pairs = pairs[np.isfinite(pairs).all(axis=1) & (pairs > 0).all(axis=1)]
    return float(np.median(pairs.max(axis=1) / pairs.min(axis=1))) if len(pairs) else np.nan


def interval(value: float, resamples: ArrayLike, level: float, bound: float = 1.0) -> Estimate:
    """Return a number with the interval of its resamples: percentiles, moved by what the resamples are off on average.

    Args:
        value: the number.
        resamples: [R] may hold ``nan``.
        level: confidence level, above 0 and below 1.
        bound: the greatest absolute value that such a number can have.
    """
    drawn = np.asarray(resamples, float)
    drawn = drawn[~np.isnan(drawn)]
    if np.isnan(value) or len(drawn) < LEAST_SHARE * np.size(resamples):
        return Estimate(float(value), np.nan, np.nan)
    low, high = np.quantile(drawn, ((1 - level) / 2, (1 + level) / 2)) - (drawn.mean() - value)
    return Estimate(float(value), float(max(low, -bound)), float(min(high, bound)))


def rank_correlations(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Pearson's correlations [K, K] of the ranks of K columns; ``nan`` where a column is constant.

    `scipy.stats.spearmanr` is the same, but gives a single ``nan`` for all columns if one is constant.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.corrcoef(rankdata(columns, axis=0), rowvar=False)
