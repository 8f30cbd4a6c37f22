"""Groups of runs compared: their learning curves, final scores and areas, and how likely one is better than another."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from statistics import median
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hierroom.lab.compare.curve import Curve, shared_steps
from hierroom.lab.compare.estimates import (
    Estimate,
    Scores,
    Strata,
    estimate,
    interquartile_mean,
    mean,
    probability_of_improvement,
)
from hierroom.lab.compare.grouping import Group
from hierroom.lab.compare.metric import METRICS, MetricName
from hierroom.lab.compare.tasks import Tasks

SUCCESS_LEVELS = (0.5, 0.9, 0.95)
ALL = "all"
"""What stands in the place of a graph for the estimates over all graphs."""


@dataclass(frozen=True)
class GroupSummary:
    """What is estimated of a group, on one graph or on all.

    ``steps_to`` has the median of the steps until a curve of the success rate is as high as each of `SUCCESS_LEVELS`,
    infinity if half or fewer are, and ``reached`` the fraction of the curves that are so high somewhere.
    """

    group: Group
    graph: str  # the graph, or `ALL`
    n_runs: int  # of its runs that were evaluated there
    n_seeds: int  # of their seeds
    n_scores: int  # of their curves, one for each run and graph
    steps: NDArray[np.float64]  # [Q] the steps trained
    curve: Estimate  # [Q] the interquartile mean of the metric there
    final_mean: Estimate  # [1] the mean of the metric at the last of them
    auc: Estimate  # [1] the interquartile mean of the areas under the curves
    auc_mean: Estimate  # [1] their mean
    steps_to: Mapping[float, float]
    reached: Mapping[float, float]


@dataclass(frozen=True)
class Improvement:
    """How likely a run of one group is better than one of another, over all graphs, at the end or by the area."""

    better: Group
    worse: Group
    score: Literal["final", "auc"]
    probability: Estimate


@dataclass(frozen=True)
class Comparison:
    """Groups compared by a metric and some entries, on some graphs."""

    metric: MetricName  # the metric
    by: tuple[str, ...]  # the entries compared by
    groups: tuple[Group, ...]  # the groups
    tasks: Tasks  # what they are compared on
    summaries: tuple[GroupSummary, ...]  # for each group one over all graphs, then one for each graph
    improvements: tuple[Improvement, ...]  # for each pair of groups, for the final score and the area

    def of_graph(self, graph: str) -> list[GroupSummary]:
        """The summaries for a graph, or for `ALL`, in the order of the groups; groups without a run are left out."""
        return [summary for summary in self.summaries if summary.graph == graph]


def compare(
    groups: Sequence[Group],
    tasks: Tasks,
    metric: MetricName,
    resamples: int,
    seed: int,
    progress: Callable[[], object] = lambda: None,
) -> Comparison:
    """Estimate everything.

    Args:
        groups: the groups, not empty, all with the same entries compared by.
        tasks: what they are compared on.
        metric: what they are compared by.
        resamples: how often the runs are resampled for each interval.
        seed: fixes the resamples.
        progress: called after each of `n_estimates` parts of the work.
    """
    steps = shared_steps([curve for group in groups for curve in tasks.curves(group, metric)])
    estimator = _Estimator(tasks, metric, steps, partial(estimate, resamples=resamples, seed=seed))
    summaries, improvements = [], []
    for group in groups:
        for graph in (ALL, *tasks.graphs):
            graphs = tasks.graphs if graph == ALL else (graph,)
            if tasks.curves(group, metric, graphs):
                summaries.append(estimator.summary(group, graph, graphs))
            progress()
    for ours, theirs in combinations(groups, 2):
        improvements += estimator.improvements(ours, theirs)
        progress()
    return Comparison(metric, tuple(groups[0].choices), tuple(groups), tasks, tuple(summaries), tuple(improvements))


def n_estimates(groups: Sequence[Group], tasks: Tasks) -> int:
    """How often `compare` calls its progress."""
    return len(groups) * (1 + len(tasks.graphs)) + len(groups) * (len(groups) - 1) // 2


@dataclass(frozen=True)
class _Estimator:
    tasks: Tasks
    metric: MetricName
    steps: NDArray[np.float64]
    estimate: Callable[[Strata, Callable[[Strata], Scores]], Estimate]

    def part(self, curve: Curve) -> Curve:
        return curve.between(self.steps[0], self.steps[-1])

    def summary(self, group: Group, graph: str, graphs: tuple[str, ...]) -> GroupSummary:
        values = self.tasks.strata(group, self.metric, lambda curve: curve.at(self.steps), graphs)
        areas = self.tasks.strata(group, self.metric, lambda curve: [self.part(curve).area], graphs)
        successes = [self.part(curve) for curve in self.tasks.curves(group, "success_rate", graphs)]
        there = [run for run in group.runs if set(self.tasks.on(run)) & set(graphs)]
        reaching = {level: np.array([curve.steps_to(level) for curve in successes]) for level in SUCCESS_LEVELS}
        return GroupSummary(
            group=group,
            graph=graph,
            n_runs=len(there),
            n_seeds=len({run.seed for run in there}),
            n_scores=len(successes),
            steps=self.steps,
            curve=self.estimate(values, interquartile_mean),
            final_mean=self.estimate([stratum[..., -1:] for stratum in values], mean),
            auc=self.estimate(areas, interquartile_mean),
            auc_mean=self.estimate(areas, mean),
            steps_to={level: median(times) for level, times in reaching.items()},
            reached={level: float(np.isfinite(times).mean()) for level, times in reaching.items()},
        )

    def improvements(self, ours: Group, theirs: Group) -> list[Improvement]:
        sign = 1 if METRICS[self.metric].is_higher_better else -1

        def scores(curve: Curve) -> Sequence[float]:
            part = self.part(curve)
            return [sign * part.values[-1], sign * part.area]

        own, other = (self.tasks.strata(group, self.metric, scores) for group in (ours, theirs))
        own_graphs, other_graphs = (self.tasks.strata_graphs(group) for group in (ours, theirs))

        def statistic(strata: Strata) -> Scores:
            return probability_of_improvement(
                _by_graph(strata[: len(own)], own_graphs, self.tasks.graphs),
                _by_graph(strata[len(own) :], other_graphs, self.tasks.graphs),
            )

        found = self.estimate([*own, *other], statistic)
        parts = [Estimate(found.values[[n]], found.lows[[n]], found.highs[[n]]) for n in range(2)]
        return [Improvement(ours, theirs, "final", parts[0]), Improvement(ours, theirs, "auc", parts[1])]


def _by_graph(strata: Strata, strata_graphs: Sequence[tuple[str, ...]], graphs: Sequence[str]) -> list[Scores]:
    """For each graph [..., R, Q] the scores of the runs that were evaluated on it."""
    return [
        np.concatenate(
            [s[..., own.index(graph), :] for s, own in zip(strata, strata_graphs, strict=True) if graph in own], axis=-2
        )
        for graph in graphs
    ]
