"""Two methods on the same goal graphs, graph by graph."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.study.bootstrap import Bootstrap
from benchmarks.study.correlations import Estimate, resampled
from benchmarks.study.tables import Row
from benchmarks.study.trained import Milestone, Trained, by_rule, medians, method_names, read_trained
from hierroom.support.errors import InputError

TELLING = ("area_under_curve", "length", "greedy_length", "achieved_", "steps_to_")
"""Prefixes of result columns; two different runs that learned something never agree in all of them."""


@dataclass(frozen=True, eq=False)
class Paired:
    """Two methods on the G goal graphs that both were trained on.

    Args:
        outcome: the milestone to compare steps by.
        graphs: [G] names, in the order of the table.
        steps: of each method, [G, S]: ``inf`` where a seed never got there, ``nan`` after a graph's last seed.
        success: of each method, [G]: the median success rate at the end of training, 0 to 1.
    """

    outcome: Milestone
    graphs: tuple[str, ...]
    steps: tuple[NDArray[np.float64], NDArray[np.float64]]
    success: tuple[NDArray[np.float64], NDArray[np.float64]]

    def on(self, graphs: Sequence[str]) -> Paired:
        """Return the same on some of the graphs."""
        kept = [n for n, graph in enumerate(self.graphs) if graph in graphs]
        (first, second), (success, other) = self.steps, self.success
        names = tuple(self.graphs[n] for n in kept)
        return Paired(self.outcome, names, (first[kept], second[kept]), (success[kept], other[kept]))

    @property
    def medians(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Median steps of each method [G]."""
        first, second = self.steps
        return medians(first), medians(second)

    @property
    def ratios(self) -> NDArray[np.float64]:
        """Median steps of the first method by those of the second [G]."""
        return ratios(*self.medians)

    @property
    def has_single_seed(self) -> NDArray[np.bool_]:
        """Flags [G] of graphs with a single seed of a method, which resamples cannot vary."""
        return np.minimum(*((~np.isnan(steps)).sum(axis=1) for steps in self.steps)) < 2

    def resampled_ratios(self, bootstrap: Bootstrap) -> NDArray[np.float64]:
        """Return the ratios [R, G] of so many resamples of the seeds of both."""
        rng = np.random.default_rng(bootstrap.seed)
        return np.array([self._resampled(rng, slice(None)) for _ in range(bootstrap.resamples)])

    def median_ratio(self, bootstrap: Bootstrap) -> Estimate:
        """Return the median ratio over the graphs, with its interval by resampling the graphs and the seeds of each.

        Of an even number of graphs it is the geometric mean of the two in the middle, so that the median of the inverse
        ratios is its inverse. With a single seed of a method, few graphs have no interval: even from the least to the
        greatest of G ratios, it would hold the median with a probability of only 1 - 2^(1 - G).
        """
        value = float(median_ratios(self.ratios[None])[0])
        rng, n = np.random.default_rng(bootstrap.seed), len(self.graphs)
        if self.has_single_seed.any() and 1 - 2.0 ** (1 - n) < bootstrap.level:
            return Estimate(value, math.nan, math.nan)
        drawn = np.array([self._resampled(rng, rng.integers(n, size=n)) for _ in range(bootstrap.resamples)])
        low, high = bootstrap.interval(median_ratios(drawn))
        return Estimate(value, float(low), float(high))

    def _resampled(self, rng: np.random.Generator, graphs: NDArray[np.int64] | slice) -> NDArray[np.float64]:
        """Return the ratios of B graphs [B]; a graph drawn twice has new seeds each time."""
        first, second = (medians(resampled(steps[graphs], rng)) for steps in self.steps)
        return ratios(first, second)


def ratios(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the first by the second [G]; 1 where both are infinite, or both 0.

    Args:
        first: [G] steps, may hold ``inf``.
        second: [G] steps of the other method.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(first == second, 1, first / second)


def median_ratios(of_graphs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the median of each row [R]; the geometric mean of the middle two where their number is even.

    Where one of these is 0 and the other infinite it is 1, as neither direction has more.

    Args:
        of_graphs: [R, G] ratios, may hold 0 and ``inf``.
    """
    ordered, n = np.sort(of_graphs, axis=1), of_graphs.shape[1]
    with np.errstate(invalid="ignore"):
        middle = np.sqrt(ordered[:, (n - 1) // 2] * ordered[:, n // 2])
    return np.where(np.isnan(middle), 1, middle)


def pair(
    rows: Sequence[Row],
    measured: Sequence[Row],
    methods: tuple[str, str],
    outcome: Milestone | None = None,
    *,
    alike: Sequence[str] = ("steps",),
) -> Paired:
    """Two methods of a table of training runs.

    Args:
        rows: of the table.
        measured: of the table of measures.
        methods: their names, as `method_names` gives them.
        outcome: the milestone; by default the lower of those that docs/study-rules.md gives the two.
        alike: what the runs of both must have in common, columns of the table if it has them. A variant may change
            the grid's size or the preset on purpose, the number of steps never.

    Raises:
        InputError: as `read_trained`, or if a method is not in the table, no graph has both, or they were trained in
            different ways.
    """
    names = method_names(rows)
    if unknown := [name for name in methods if name not in names]:
        raise InputError(f"the table's methods are {', '.join(dict.fromkeys(names))}; there is no {unknown[0]!r}")
    own = [row for row, name in zip(rows, names, strict=True) if name in methods]
    for name in alike:
        if len(found := {row.get(name, "") for row in own}) > 1:
            raise InputError(f"the two methods were trained with different {name}: {', '.join(sorted(found))}")
    outcome = outcome or _lower_milestone(own, measured)
    steps = _of_methods(read_trained(rows, measured, outcome), methods)
    failures = _of_methods(read_trained(rows, measured, "success_rate"), methods)
    graphs = tuple(graph for graph in steps[0].graphs if graph in steps[1].graphs)
    if not graphs:
        raise InputError(f"no goal graph has runs of both {' and '.join(methods)}")
    one, other = (_outcomes(trained, graphs) for trained in steps)
    ends = [1 - medians(_outcomes(trained, graphs)) for trained in failures]
    return Paired(outcome, graphs, (one, other), (ends[0], ends[1]))


def graphs_of_equal_runs(rows: Sequence[Row], methods: tuple[str, str]) -> frozenset[str]:
    """Return the graphs on which two methods are the same: runs of a seed learned something, and ended alike.

    One seed is enough, because equal runs differ by rounding where they were made on different kinds of processor.

    Args:
        rows: of a table of training runs; without the areas under the learning curves no runs count as equal.
        methods: the names of the methods.
    """
    ends: dict[str, list[set[tuple[str, ...]]]] = {}
    for row, name in zip(rows, method_names(rows), strict=True):
        for n, method in enumerate(methods):
            if name == method:
                given = (row["seed"], row.get("area_under_curve", ""), *_results(row))
                ends.setdefault(row["graph"], [set(), set()])[n].add(given)
    return frozenset(
        graph for graph, (first, second) in ends.items() if any(float(area or 0) for _, area, *_ in first & second)
    )


def _results(row: Row) -> list[str]:
    return [text for column, text in sorted(row.items()) if column.startswith(TELLING)]


def _of_methods(trained: Sequence[Trained], names: Sequence[str]) -> list[Trained]:
    by_name = {one.method: one for one in trained}
    return [by_name[name] for name in names]


def _lower_milestone(rows: Sequence[Row], measured: Sequence[Row]) -> Milestone:
    """Return the lower of the methods' milestones, each by all graphs that its method was trained on."""
    return "steps_to_50" if by_rule(rows, measured)["steps_to_50"] else "steps_to_95"


def _outcomes(trained: Trained, graphs: Sequence[str]) -> NDArray[np.float64]:
    return trained.outcomes[[trained.graphs.index(graph) for graph in graphs]]
