"""Groups of runs compared: their learning curves, final scores and areas, and how likely one is better than another."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
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

    Args:
        group: the group.
        graph: the graph, or `ALL`.
        n_runs: number of its runs that were evaluated there.
        n_seeds: number of their seeds.
        n_scores: number of their curves, one for each run and graph.
        steps: [Q] the steps trained.
        curve: [Q] the interquartile mean of the metric there.
        final_mean: [1] the mean of the metric at the last of them.
        auc: [1] the interquartile mean of the areas under the curves.
        auc_mean: [1] their mean.
        steps_to: for each of `SUCCESS_LEVELS` the median of the steps until a curve of the success rate is that high;
            infinity if half or fewer are.
        reached: for each of them the fraction of the curves that are that high somewhere.
    """

    group: Group
    graph: str
    n_runs: int
    n_seeds: int
    n_scores: int
    steps: NDArray[np.float64]
    curve: Estimate
    final_mean: Estimate
    auc: Estimate
    auc_mean: Estimate
    steps_to: Mapping[float, float]
    reached: Mapping[float, float]


@dataclass(frozen=True)
class Improvement:
    """How likely a run of one group is better than one of another, over all graphs.

    Args:
        better: the one group.
        worse: the other.
        score: what is compared: the metric at the end, or the area under its curve.
        probability: [1] the probability.
    """

    better: Group
    worse: Group
    score: Literal["final", "auc"]
    probability: Estimate


@dataclass(frozen=True)
class Comparison:
    """Groups compared by a metric.

    Args:
        metric: the metric.
        by: the entries compared by.
        groups: the groups.
        tasks: what they are compared on.
        summaries: for each group one over all graphs, then one for each graph.
        improvements: for each pair of groups, for the final score and the area.
    """

    metric: MetricName
    by: tuple[str, ...]
    groups: tuple[Group, ...]
    tasks: Tasks
    summaries: tuple[GroupSummary, ...]
    improvements: tuple[Improvement, ...]

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
    summaries, improvements = [], []
    for group in groups:
        for graph in (ALL, *tasks.graphs):
            graphs = tasks.graphs if graph == ALL else (graph,)
            if tasks.curves(group, metric, graphs):
                summaries.append(_summarize(group, graph, graphs, tasks, metric, steps, resamples, seed))
            progress()
    for ours, theirs in combinations(groups, 2):
        improvements += _improvements(ours, theirs, tasks, metric, steps, resamples, seed)
        progress()
    return Comparison(metric, tuple(groups[0].choices), tuple(groups), tasks, tuple(summaries), tuple(improvements))


def n_estimates(groups: Sequence[Group], tasks: Tasks) -> int:
    """How often `compare` calls its progress."""
    return len(groups) * (1 + len(tasks.graphs)) + len(groups) * (len(groups) - 1) // 2


def _summarize(
    group: Group,
    graph: str,
    graphs: tuple[str, ...],
    tasks: Tasks,
    metric: MetricName,
    steps: NDArray[np.float64],
    resamples: int,
    seed: int,
) -> GroupSummary:
    values = tasks.strata(group, metric, lambda curve: curve.at(steps), graphs)
    areas = tasks.strata(group, metric, lambda curve: [curve.between(steps[0], steps[-1]).area], graphs)
    successes = [curve.between(steps[0], steps[-1]) for curve in tasks.curves(group, "success_rate", graphs)]
    there = [run for run in group.runs if set(tasks.on(run)) & set(graphs)]
    reaching = {level: np.array([curve.steps_to(level) for curve in successes]) for level in SUCCESS_LEVELS}
    return GroupSummary(
        group=group,
        graph=graph,
        n_runs=len(there),
        n_seeds=len({run.seed for run in there}),
        n_scores=len(successes),
        steps=steps,
        curve=estimate(values, interquartile_mean, resamples, seed),
        final_mean=estimate([stratum[..., -1:] for stratum in values], mean, resamples, seed),
        auc=estimate(areas, interquartile_mean, resamples, seed),
        auc_mean=estimate(areas, mean, resamples, seed),
        steps_to={level: _median(times) for level, times in reaching.items()},
        reached={level: float(np.isfinite(times).mean()) for level, times in reaching.items()},
    )


def _improvements(
    ours: Group,
    theirs: Group,
    tasks: Tasks,
    metric: MetricName,
    steps: NDArray[np.float64],
    resamples: int,
    seed: int,
) -> list[Improvement]:
    sign = 1 if METRICS[metric].is_higher_better else -1

    def scores(curve: Curve) -> Sequence[float]:
        part = curve.between(steps[0], steps[-1])
        return [sign * part.values[-1], sign * part.area]

    own, other = (tasks.strata(group, metric, scores) for group in (ours, theirs))
    own_graphs, other_graphs = (tasks.strata_graphs(group) for group in (ours, theirs))

    def statistic(strata: Strata) -> Scores:
        return probability_of_improvement(
            _by_graph(strata[: len(own)], own_graphs, tasks.graphs),
            _by_graph(strata[len(own) :], other_graphs, tasks.graphs),
        )

    found = estimate([*own, *other], statistic, resamples, seed)
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


def _median(times: NDArray[np.float64]) -> float:
    """The median where infinity is beyond any time; of an even number of times the mean of the middle two."""
    low, high = np.sort(times)[[(len(times) - 1) // 2, len(times) // 2]]
    return float((low + high) / 2)
