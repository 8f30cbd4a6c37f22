"""Complexity and learning: how hard each goal graph is, and how long learning on it took."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hierroom.complexity.report import analyze
from hierroom.goals import Rules
from hierroom.lab.compare.comparison import SUCCESS_LEVELS
from hierroom.lab.compare.tasks import ALL
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


def complexities(runs: Sequence[ReportedRun], rules: Mapping[str, Rules]) -> tuple[list[dict[str, Any]], list[str]]:
    """Return the complexity of the graphs of some runs, and of the rules of tasks, a row for each.

    Also return notes on those that are too large.
    """
    keys = ((name, graph, run.config.env.drop_key) for run in runs for name, graph in run.graphs.items())
    rows, notes = [], []
    for name, graph, drop_key in [*dict.fromkeys(keys), *((name, one, False) for name, one in rules.items())]:
        try:
            report, n_rooms = analyze(graph, drop_key=drop_key), getattr(graph, "n_rooms", None)
            measures = [report.expected_steps, report.hitting_time, report.exit_depth, report.width, n_rooms]
        except InputError as error:
            notes.append(f"no complexity of {name if name in rules else f'graph {name}'}: {error}")
            continue
        values = dict(zip(MEASURES, rounded(measures), strict=True))
        rows.append({**_named(name, drop_key), "measures": values})
    return rows, notes


def known_measures(rows: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Return the labels, by name, of the measures that at least one row of `complexities` has."""
    return {name: label for name, label in MEASURES.items() if any(row["measures"][name] is not None for row in rows)}


def learning_points(curves: Curves) -> list[dict[str, Any]]:
    """Return each group's median steps to levels of success on each graph; skip it if only some runs can drop keys."""
    return [
        {
            "group": group,
            **_named(str(summary.graph), drop_key),
            "n": summary.n_runs,
            "steps_to": {f"{100 * level:.0f}": rounded([summary.steps_to[level]])[0] for level in SUCCESS_LEVELS},
            "last": float(summary.steps[-1]),
        }
        for group, metric, summary in drawn(curves)
        if metric == "success_rate" and summary.graph != ALL
        for drop_key, *others in [
            {run.entries["drop_key"] for run in summary.group.runs if summary.graph in run.curves}
        ]
        if not others
    ]


def _named(graph: str, drop_key: bool) -> dict[str, Any]:
    """Return what identifies a goal graph in a report, and its label, which says if keys can be dropped."""
    return {"graph": graph, "drop_key": drop_key, "label": f"{graph}, keys can be dropped" if drop_key else graph}
