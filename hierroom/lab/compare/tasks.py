"""The goal graphs on which groups of runs are compared, and the runs' scores on them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.lab.compare.curve import Curve, MetricName, mean_curve
from hierroom.lab.compare.evaluated_run import EvaluatedRun
from hierroom.lab.compare.grouping import Group
from hierroom.support.errors import InputError


class Together(Enum):
    """Stand for several goal graphs; unlike a text, it equals the name of none."""

    ALL = "all"  # those that all groups have
    OWN = "own"  # those on which a run was evaluated

    def __str__(self) -> str:
        return self.value


ALL, OWN = Together
Place = str | Together
"""The name of a goal graph, or several together."""


@dataclass(frozen=True)
class Tasks:
    """The names of the goal graphs that all groups have, or `OWN` alone."""

    graphs: tuple[Place, ...]
    kind: str = "graph"  # graph, layout or task: see `EnvConfig.kind`

    @classmethod
    def common(cls, groups: Sequence[Group]) -> Tasks:
        """Return the graphs that all groups have; `OWN` if there are none and the groups differ by graph."""
        by_group, kind = graphs_of(groups), common_kind(run.kind for group in groups for run in group.runs)
        if shared := set.intersection(*by_group):
            return cls(tuple(sorted(shared)), kind)
        if not groups[0].choices.keys().isdisjoint({"graph", "layout", "task"}):
            return cls((OWN,), kind)
        names = "; ".join(f"{g.label}: {', '.join(sorted(graphs))}" for g, graphs in zip(groups, by_group, strict=True))
        what = cls((), kind).called
        raise InputError(f"the groups have no {what} in common ({names}); add {kind} to --by, or leave some out")

    @property
    def called(self) -> str:
        """The kind in words."""
        return "goal graph" if self.kind == "graph" else self.kind

    def on(self, run: EvaluatedRun) -> tuple[Place, ...]:
        """Return the graphs on which a run was evaluated."""
        return tuple(graph for graph in self.graphs if graph == OWN or graph in run.curves)

    def curve(self, run: EvaluatedRun, graph: Place, metric: MetricName) -> Curve:
        """Return the learning curve of a run on a graph; for `OWN`, the mean over its graphs."""
        if isinstance(graph, Together):
            return mean_curve([metrics[metric] for metrics in run.curves.values()])
        return run.curves[graph][metric]

    def curves(self, group: Group, metric: MetricName, graphs: Sequence[Place]) -> list[Curve]:
        """Return the curves of a group's runs on some graphs."""
        return [self.curve(run, graph, metric) for run in group.runs for graph in self.on(run) if graph in graphs]

    def strata(
        self, group: Group, metric: MetricName, scores: Callable[[Curve], ArrayLike], graphs: Sequence[Place]
    ) -> dict[tuple[Place, ...], NDArray[np.float64]]:
        """Return the scores [R, K, Q] of R runs for each set of K graphs; ``scores`` returns a curve's scores [Q]."""
        strata: dict[tuple[Place, ...], list[list[ArrayLike]]] = {}
        for run in group.runs:
            if own := tuple(graph for graph in self.on(run) if graph in graphs):
                strata.setdefault(own, []).append([scores(self.curve(run, graph, metric)) for graph in own])
        return {own: np.array(runs, float) for own, runs in strata.items()}


def common_kind(kinds: Iterable[str]) -> str:
    """Return the common kind of several runs: task, layout or graph; graph if they differ."""
    different = {*kinds}
    return different.pop() if len(different) == 1 else "graph"


def graphs_of(groups: Sequence[Group]) -> list[set[str]]:
    """Return the names of each group's graphs; refuse two different ones with the same name."""
    named: dict[str, EvaluatedRun] = {}
    for run in (run for group in groups for run in group.runs):
        for name, graph in run.user_graphs.items():
            if named.setdefault(name, run).user_graphs[name] != graph:
                both = f"in {named[name].path} and in {run.path}"
                raise InputError(
                    f"two different goal graphs, layouts or tasks are called {name}, {both}; compare one at a time"
                )
    return [{graph for run in group.runs for graph in run.curves} for group in groups]
