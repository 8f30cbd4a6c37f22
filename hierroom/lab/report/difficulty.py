"""Complexity against learning: how hard each goal graph is, computed, beside how long learning took on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hierroom.complexity.report import analyze
from hierroom.goals import GoalGraph
from hierroom.lab.compare.comparison import ALL, SUCCESS_LEVELS, GroupSummary
from hierroom.lab.report.curves import Curves, drawn, rounded
from hierroom.lab.report.runs import ReportedRun
from hierroom.support.errors import InputError

MEASURES: Mapping[str, str] = {
    "expected_steps": "expected steps of a random walk, true",
    "hitting_time": "hitting time, paper's",
    "exit_depth": "exit depth",
    "width": "width",
    "n_rooms": "rooms",
}
"""What is computed of a graph, and what it is called."""


def complexities(runs: Sequence[ReportedRun]) -> tuple[list[dict[str, Any]], list[str]]:
    """How hard the graphs of some runs are to explore: a row for each, and lines on those that are too large.

    A row has ``name``, ``label``, ``key_rooms``, ``exit_room``, whether keys can be dropped, and `MEASURES`.
    """
    graphs: dict[tuple[str, GoalGraph, bool], None] = {}
    for run in runs:
        for name, graph in run.graphs.items():
            graphs.setdefault((name, graph, run.config.env.drop_key))
    rows, notes = [], []
    for name, graph, drop_key in graphs:
        try:
            report = analyze(graph, drop_key=drop_key)
            measures = [report.expected_steps, report.hitting_time, report.exit_depth, report.width, graph.n_rooms]
        except InputError as error:
            notes.append(f"no complexity of graph {name}: {error}")
            continue
        values = dict(zip(MEASURES, rounded(measures), strict=True))
        shape = {"key_rooms": list(graph.key_rooms), "exit_room": graph.exit_room}
        label = graph_label(name, drop_key)
        rows.append({"name": name, "label": label, "drop_key": drop_key, **shape, "measures": values})
    return rows, notes


def learning_points(curves: Curves) -> list[dict[str, Any]]:
    """How many steps each group needed on each graph: the median over its runs; None where half or fewer got there.

    A point has numbers by level of success, the ``last`` step that was looked at, and whether keys can be dropped; a
    group in which they can be in some runs and not in others has none.
    """
    return [
        {
            "group": group,
            "graph": summary.graph,
            "drop_key": drop_key,
            "label": graph_label(summary.graph, drop_key),
            "n": summary.n_runs,
            "steps_to": {f"{100 * level:.0f}": rounded([summary.steps_to[level]])[0] for level in SUCCESS_LEVELS},
            "last": float(summary.steps[-1]),
        }
        for group, metric, summary in drawn(curves)
        if metric == "success_rate" and summary.graph != ALL
        for drop_key, *others in [_drop_keys(summary)]
        if not others
    ]


def _drop_keys(summary: GroupSummary) -> set[bool]:
    """Whether keys can be dropped in the runs of a group on a graph: one answer, or both."""
    return {run.entries["drop_key"] for run in summary.group.runs if summary.graph in run.curves}


def graph_label(name: str, drop_key: bool) -> str:
    """What a goal graph is called where keys can be dropped, or not."""
    return f"{name}, keys can be dropped" if drop_key else name
