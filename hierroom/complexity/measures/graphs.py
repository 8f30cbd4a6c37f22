"""The measures of goal graphs, computed one after the other with a progress bar."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

from rich.console import Console
from rich.progress import track

from hierroom.complexity.measures.graph_mdp import graph_mdp
from hierroom.complexity.measures.summary import measure_mdp, measure_walk
from hierroom.complexity.measures.table import MeasuredGraph
from hierroom.complexity.report import analyze
from hierroom.complexity.walk import PAPER_WALK, TABLE_READING, Reading, Walk
from hierroom.goals import GoalGraph

Item = TypeVar("Item")


def measure_graphs(
    graphs: Sequence[GoalGraph],
    horizon: int = 20,
    drop_key: bool = False,
    walk: Walk = PAPER_WALK,
    reading: Reading = TABLE_READING,
) -> list[MeasuredGraph]:
    """Measure goal graphs, each as an MDP over its nodes and as the assumed walk.

    Rooms are numbered in one way whatever their numbers are, as policies and walks that are drawn would differ.

    Args:
        graphs: the goal graphs.
        horizon: steps of an episode on the MDP, at least as many as a shortest solution has.
        drop_key: whether keys can be dropped.
        walk: the probabilities of one step of the walk; policies on the MDP choose among the moves themselves.
        reading: of the augmented graph, whose nodes are the states of both.
    """

    def measure(graph: GoalGraph) -> MeasuredGraph:
        report = analyze(graph.canonical(), drop_key, walk, reading)
        mdp = graph_mdp(report.augmented)
        return MeasuredGraph(graph.name, measure_mdp(mdp, horizon), measure_walk(report.chain))

    return with_progress(measure, graphs, "measuring")


def with_progress(
    measure: Callable[[Item], MeasuredGraph], items: Iterable[Item], description: str
) -> list[MeasuredGraph]:
    """Measure each item, with a progress bar that disappears."""
    console = Console(stderr=True)
    is_hidden = not console.is_terminal  # in a file it would leave an empty line
    tracked = track(list(items), description, console=console, transient=True, disable=is_hidden)
    return [measure(item) for item in tracked]
