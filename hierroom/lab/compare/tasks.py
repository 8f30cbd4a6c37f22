"""The goal graphs to compare groups of runs on, and the runs' scores on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.lab.compare.curve import Curve, MetricName, mean_curve
from hierroom.lab.compare.evaluated_run import EvaluatedRun
from hierroom.lab.compare.grouping import Group
from hierroom.support.errors import InputError

OWN = "own"  # the graphs that a run was evaluated on, whichever they are


@dataclass(frozen=True)
class Tasks:
    """The names of the goal graphs that all groups have, or `OWN` alone."""

    graphs: tuple[str, ...]

    @classmethod
    def common(cls, groups: Sequence[Group]) -> Tasks:
        """Return the graphs of all groups; `OWN` if there is none and graphs make the groups."""
        refuse_namesakes(groups)
        by_group = [{graph for run in group.runs for graph in run.curves} for group in groups]
        shared = set.intersection(*by_group)
        if shared:
            return cls(tuple(sorted(shared)))
        if "graph" in groups[0].choices:
            return cls((OWN,))
        names = "; ".join(f"{g.label}: {', '.join(sorted(graphs))}" for g, graphs in zip(groups, by_group, strict=True))
        raise InputError(f"the groups have no goal graph in common ({names}); add graph to --by, or leave some out")

    def on(self, run: EvaluatedRun) -> tuple[str, ...]:
        """Return those of the graphs that a run was evaluated on."""
        return tuple(graph for graph in self.graphs if graph == OWN or graph in run.curves)

    def curve(self, run: EvaluatedRun, graph: str, metric: MetricName) -> Curve:
        """Return the learning curve of a run on a graph; on `OWN` the mean over its graphs."""
        if graph == OWN:
            return mean_curve([metrics[metric] for metrics in run.curves.values()])
        return run.curves[graph][metric]

    def curves(self, group: Group, metric: MetricName, graphs: Sequence[str] | None = None) -> list[Curve]:
        """Return the curves of a group's runs on some graphs, by default all."""
        strata = self._strata(group, graphs).items()
        return [self.curve(run, graph, metric) for own, runs in strata for run in runs for graph in own]

    def strata_graphs(self, group: Group, graphs: Sequence[str] | None = None) -> list[tuple[str, ...]]:
        """Return the graphs of each stratum: the runs of a group that were evaluated on the same graphs."""
        return list(self._strata(group, graphs))

    def strata(
        self,
        group: Group,
        metric: MetricName,
        scores: Callable[[Curve], ArrayLike],
        graphs: Sequence[str] | None = None,
    ) -> list[NDArray[np.float64]]:
        """Return the scores of a group for `compare.estimates`: for each stratum [R, K, Q].

        ``scores`` makes the scores [Q] of a curve of the metric.
        """
        return [
            np.array([[scores(self.curve(run, graph, metric)) for graph in own] for run in runs], float)
            for own, runs in self._strata(group, graphs).items()
        ]

    def _strata(self, group: Group, graphs: Sequence[str] | None) -> dict[tuple[str, ...], list[EvaluatedRun]]:
        wanted = self.graphs if graphs is None else graphs
        strata: dict[tuple[str, ...], list[EvaluatedRun]] = {}
        for run in group.runs:
            own = tuple(graph for graph in self.on(run) if graph in wanted)
            if own:
                strata.setdefault(own, []).append(run)
        return strata


def refuse_namesakes(groups: Sequence[Group]) -> None:
    """Refuse two different goal graphs of the same name, which would be taken for one."""
    named: dict[str, EvaluatedRun] = {}
    for run in (run for group in groups for run in group.runs):
        for name, graph in run.own_graphs.items():
            if named.setdefault(name, run).own_graphs[name] != graph:
                both = f"in {named[name].path} and in {run.path}"
                raise InputError(f"two different goal graphs are called {name}, {both}; compare one of them at a time")
