"""Compare groups of runs: learning curves, final scores, areas, and how likely one group is better than another."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.lab.compare.curve import Curve, MetricName, metric_of, shared_steps
from hierroom.lab.compare.estimates import (
    Estimate,
    Scores,
    Strata,
    estimate,
    interquartile_mean,
    mean,
    probability_of_improvement,
)
from hierroom.lab.compare.evaluated_run import known_metrics
from hierroom.lab.compare.grouping import Group
from hierroom.lab.compare.tasks import ALL, Place, Tasks
from hierroom.runs.folder.predicted import Prediction

SUCCESS_LEVELS = (0.5, 0.9, 0.95)
SCORES = ("final", "auc")  # of a run: the metric at the last steps, and the area under its curve


@dataclass(frozen=True)
class GroupSummary:
    """The estimates of a group, on one graph or on `ALL`."""

    group: Group
    graph: Place
    n_runs: int  # runs that were evaluated there
    n_seeds: int
    n_scores: int  # number of curves, one for each run and graph
    steps: NDArray[np.float64]  # [Q] the steps trained
    curve: Estimate  # [Q] the interquartile mean of the metric
    final_mean: Estimate  # [1] the mean of the metric at the last steps
    auc: Estimate  # [1] the interquartile mean of the areas under the curves
    auc_mean: Estimate  # [1] the mean of these areas
    steps_to: Mapping[float, float]  # median steps to `SUCCESS_LEVELS` of `shares`; infinity if half or fewer reach it
    reached: Mapping[float, float]  # the fraction of the curves that reach each level

    @property
    def prediction(self) -> Prediction | None:
        """What was predicted of its runs on the graph, if they were trained on it alone and all have the same."""
        there = [run for run in self.group.runs if self.graph in run.curves and len(run.curves) == 1]
        found = {run.prediction for run in there}
        return found.pop() if len(found) == 1 else None

    def judged(self) -> str:
        """Return the prediction next to the median of the measured steps; empty without one."""
        took = {round(100 * level): steps for level, steps in self.steps_to.items()}
        return "" if self.prediction is None else self.prediction.judged(took, self.steps[-1])


@dataclass(frozen=True)
class Improvement:
    """The probability that a run of one group beats one of another, over all graphs."""

    better: Group
    worse: Group
    probability: Estimate  # [2] by the `SCORES`


@dataclass(frozen=True)
class Comparison:
    """A comparison of groups by a metric on some graphs."""

    metric: MetricName
    by: tuple[str, ...]  # the entries by which runs are grouped
    groups: tuple[Group, ...]
    tasks: Tasks
    summaries: tuple[GroupSummary, ...]  # for each group one over all graphs, then one for each graph
    improvements: tuple[Improvement, ...]  # for each pair of groups

    def of_graph(self, graph: Place) -> list[GroupSummary]:
        """Return the summaries for a graph, or for `ALL`, of the groups that have runs there."""
        return [summary for summary in self.summaries if summary.graph == graph]


def compare(
    groups: Sequence[Group],
    tasks: Tasks,
    metric: MetricName,
    resamples: int,
    seed: int,
    track: Callable[[Sequence[Any]], Iterable[Any]] = lambda work: work,
) -> Comparison:
    """Estimate everything, with intervals from ``resamples`` resamples; ``track`` may show the progress."""
    steps = shared_steps([curve for group in groups for curve in tasks.curves(group, metric, tasks.graphs)])
    estimates = partial(estimate, resamples=resamples, seed=seed)
    estimator = _Estimator(tasks, metric, steps, estimates, shares(groups, tasks, level_metric(metric, groups)))
    places = [(ALL, tasks.graphs), *((graph, (graph,)) for graph in tasks.graphs)]
    parts = [(group, *place) for group in groups for place in places if tasks.curves(group, metric, place[1])]
    summaries = tuple(estimator.summary(*part) for part in track(parts))
    improvements = tuple(estimator.improvement(*pair) for pair in track([*combinations(groups, 2)]))
    return Comparison(metric, tuple(groups[0].choices), tuple(groups), tasks, summaries, improvements)


def level_metric(metric: MetricName, groups: Sequence[Group]) -> MetricName:
    """Return the metric of the steps to `SUCCESS_LEVELS`: the comparison's if it is a rate, else the usual one."""
    return metric if metric_of(metric).is_rate else known_metrics(run for group in groups for run in group.runs)[0]


def shares(
    groups: Sequence[Group], tasks: Tasks, metric: MetricName
) -> Callable[[Group, Sequence[Place]], list[Curve]]:
    """Return a function from a group and graphs to curves from 0 to 1: of a rate, or of the returns.

    Returns are shares of the way from the lowest first to the highest last one of all groups on that graph.
    """
    if metric_of(metric).is_rate:
        return lambda group, graphs: tasks.curves(group, metric, graphs)
    ends = {}
    for graph in tasks.graphs:
        curves = [curve for group in groups for curve in tasks.curves(group, "return", [graph])]
        low, high = min(curve.values[0] for curve in curves), max(curve.values[-1] for curve in curves)
        ends[graph] = low, high - low or np.nan
    return lambda group, graphs: [
        Curve(curve.steps, (curve.values - ends[graph][0]) / ends[graph][1])
        for graph in graphs
        for curve in tasks.curves(group, "return", [graph])
    ]


@dataclass(frozen=True)
class _Estimator:
    tasks: Tasks
    metric: MetricName
    steps: NDArray[np.float64]
    estimate: Callable[[Strata, Callable[[Strata], Scores]], Estimate]
    shares: Callable[[Group, Sequence[Place]], list[Curve]]

    def part(self, curve: Curve) -> Curve:
        return curve.between(self.steps[0], self.steps[-1])

    def summary(self, group: Group, graph: Place, graphs: tuple[Place, ...]) -> GroupSummary:
        values = [*self.tasks.strata(group, self.metric, lambda curve: curve.at(self.steps), graphs).values()]
        areas = [*self.tasks.strata(group, self.metric, lambda curve: [self.part(curve).area], graphs).values()]
        successes = [self.part(curve) for curve in self.shares(group, graphs)]
        there = [run for run in group.runs if set(self.tasks.on(run)) & set(graphs)]
        reaching = {level: np.array([curve.steps_to(level) for curve in successes]) for level in SUCCESS_LEVELS}
        return GroupSummary(
            group=group,
            graph=graph,
            n_runs=len(there),
            n_seeds=len({run.entries["seed"] for run in there}),
            n_scores=len(successes),
            steps=self.steps,
            curve=self.estimate(values, interquartile_mean),
            final_mean=self.estimate([stratum[..., -1:] for stratum in values], mean),
            auc=self.estimate(areas, interquartile_mean),
            auc_mean=self.estimate(areas, mean),
            steps_to={level: median(times) for level, times in reaching.items()},
            reached={level: float(np.isfinite(times).mean()) for level, times in reaching.items()},
        )

    def improvement(self, ours: Group, theirs: Group) -> Improvement:
        sign = 1 if metric_of(self.metric).is_higher_better else -1

        def scores(curve: Curve) -> Sequence[float]:
            part = self.part(curve)
            return [sign * part.values[-1], sign * part.area]

        own, other = (self.tasks.strata(group, self.metric, scores, self.tasks.graphs) for group in (ours, theirs))

        def statistic(strata: Strata) -> Scores:
            return probability_of_improvement(
                _by_graph(strata[: len(own)], [*own], self.tasks.graphs),
                _by_graph(strata[len(own) :], [*other], self.tasks.graphs),
            )

        return Improvement(ours, theirs, self.estimate([*own.values(), *other.values()], statistic))


def _by_graph(strata: Strata, strata_graphs: Sequence[tuple[Place, ...]], graphs: Sequence[Place]) -> list[Scores]:
    return [
        np.concatenate(
            [s[..., own.index(graph), :] for s, own in zip(strata, strata_graphs, strict=True) if graph in own], axis=-2
        )
        for graph in graphs
    ]
