"""The goal graphs that groups of runs are compared on, and the runs' scores on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.lab.compare.curve import Curve, mean_curve
from hierroom.lab.compare.evaluated_run import EvaluatedRun
from hierroom.lab.compare.grouping import Group
from hierroom.lab.compare.metric import MetricName
from hierroom.support.errors import InputError

OWN = "own"
"""Stands for whichever graphs a run was evaluated on, where groups of different graphs are compared."""


@dataclass(frozen=True)
class Tasks:
    """What groups are compared on."""

    graphs: tuple[str, ...]  # names of the graphs that all groups have, or `OWN` alone

    @classmethod
    def common(cls, groups: Sequence[Group]) -> Tasks:
        """The graphs that all groups were evaluated on; `OWN` where there is none and groups are compared by graph."""
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
        """Those of the graphs that a run was evaluated on."""
        return tuple(graph for graph in self.graphs if graph == OWN or graph in run.curves)

    def curve(self, run: EvaluatedRun, graph: str, metric: MetricName) -> Curve:
        """The learning curve of a run on a graph; on `OWN` the mean over all that it was evaluated on."""
        if graph == OWN:
            return mean_curve([metrics[metric] for metrics in run.curves.values()])
        return run.curves[graph][metric]

    def curves(self, group: Group, metric: MetricName, graphs: Sequence[str] | None = None) -> list[Curve]:
        """The curves of a group's runs on some graphs, by default all."""
        wanted = self.graphs if graphs is None else graphs
        return [self.curve(run, graph, metric) for run in group.runs for graph in self.on(run) if graph in wanted]

    def strata_graphs(self, group: Group, graphs: Sequence[str] | None = None) -> list[tuple[str, ...]]:
        """The graphs of each stratum of a group: runs that were evaluated on the same graphs are one."""
        return list(self._strata(group, graphs))

    def strata(
        self,
        group: Group,
        metric: MetricName,
        scores: Callable[[Curve], ArrayLike],
        graphs: Sequence[str] | None = None,
    ) -> list[NDArray[np.float64]]:
        """The scores of a group as `compare.estimates` takes them: for each stratum [R, K, Q].

        ``scores`` makes the scores [Q] of a curve of the metric; ``graphs`` are some of the graphs, by default all.
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
                raise InputError(
                    f"two different goal graphs are called {name}, in {named[name].path} and in {run.path}; "
                    "compare one of them at a time"
                )
