"""Learning in a report: curves of runs and groups with bands, goals achieved, and how hard each goal graph is."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from hierroom.agents.evaluation import Evaluation
from hierroom.complexity.report import analyze
from hierroom.goals import Rules
from hierroom.lab.compare.caveats import caveats
from hierroom.lab.compare.comparison import SUCCESS_LEVELS, Comparison, GroupSummary, compare
from hierroom.lab.compare.evaluated_run import EvaluatedRun, known_metrics, refuse_without_overlap
from hierroom.lab.compare.grouping import Group, choose_groups, entries_named
from hierroom.lab.compare.tasks import ALL, Tasks, common_kind, graphs_of
from hierroom.lab.report.runs import ReportedRun
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.support.errors import InputError

RESAMPLES = 1000
N_BINS, LEAST_IN_BIN = 40, 10  # most points of a curve of goals, and fewest episodes of each


@dataclass(frozen=True)
class Curves:
    """The groups of a report, and comparisons by each metric, on the shared graphs and on each of the others."""

    labels: list[str]  # the groups' names
    group_of: dict[str, int]  # the number of each run's group, by the run's path
    by: tuple[str, ...] = ()  # the entries by which runs are grouped; none if each run is a group
    comparisons: list[Comparison] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def compare_runs(runs: Sequence[ReportedRun], by: str | None, progress: Callable[[], object] = lambda: None) -> Curves:
    """Group the runs by some entries, or by those that differ, and estimate curves; if that fails, show single runs."""
    evaluated = [run.evaluated for run in runs if run.evaluated is not None]
    alone = Curves([run.name for run in runs], {str(run.path): n for n, run in enumerate(runs)})
    if by is not None:
        entries_named(by, runs[0].entries)  # refuses others
    if not evaluated:
        return alone
    try:
        groups = choose_groups(evaluated, by)
        parts, comparisons = _parts(groups), []
        for members, _ in parts:
            refuse_without_overlap([run for group in members for run in group.runs])
        for metric in known_metrics(evaluated):
            comparisons += [compare(members, part, metric, RESAMPLES, 0) for members, part in parts]
            progress()
    except InputError as error:
        if by is not None:
            raise
        alone.notes.append(f"the runs are shown one by one: {error}")
        return alone
    labels = [group.label for group in groups]
    group_of = {str(run.path): n for n, group in enumerate(groups) for run in group.runs}
    for run in runs:
        if str(run.path) not in group_of:
            group_of[str(run.path)] = len(labels)
            labels.append(run.name)
    notes = [note for note in caveats(comparisons[0]) if not note.startswith("left out")]
    if len(evaluated) == 1:
        notes = [note for note in notes if note.startswith(("compared", "not compared")) or "% predicted " in note]
    return Curves(labels, group_of, tuple(groups[0].choices), comparisons, notes)


def _parts(groups: Sequence[Group]) -> list[tuple[Sequence[Group], Tasks]]:
    by_group = graphs_of(groups)
    shared = set.intersection(*by_group)
    kind = common_kind(run.kind for group in groups for run in group.runs)
    parts: list[tuple[Sequence[Group], Tasks]] = [(groups, Tasks.common(groups))] if shared else []
    for graph in sorted(set.union(*by_group) - shared):
        members = [group for group, own in zip(groups, by_group, strict=True) if graph in own]
        parts.append((members, Tasks((graph,), kind)))
    return parts


def drawn(curves: Curves) -> list[tuple[int, str, GroupSummary]]:
    """Return each curve to draw, with its group's number and its metric; one over all graphs only if several exist."""
    return [
        (curves.group_of[str(summary.group.runs[0].path)], comparison.metric, summary)
        for comparison in curves.comparisons
        for summary in comparison.summaries
        if summary.graph != ALL or len(comparison.tasks.graphs) > 1
    ]


def curve_rows(curves: Curves) -> list[dict[str, Any]]:
    """Return the groups' curves for the page: one for each group, graph (None: all together) and metric."""
    return [
        {
            "group": group,
            "graph": None if summary.graph == ALL else summary.graph,
            "metric": metric,
            "n": summary.n_runs,
            "steps": rounded(summary.steps),
            "values": rounded(summary.curve.values),
            "lows": rounded(summary.curve.lows),
            "highs": rounded(summary.curve.highs),
            "predicted": [  # success in percent, the steps, and the ends of their interval; None beyond the horizon
                rounded([percent, steps, steps.low, steps.high])
                for percent, steps in (summary.prediction.steps_to.items() if summary.prediction else ())
                if metric == "success_rate"
            ],
        }
        for group, metric, summary in drawn(curves)
    ]


def run_rows(runs: Sequence[ReportedRun], curves: Curves) -> list[dict[str, Any]]:
    """Return the runs' curves for the page: for each graph, steps, seconds, metrics, and the interval of success."""
    return [
        {"name": run.name, "group": curves.group_of[str(run.path)], "graphs": _graph_curves(run.evaluated)}
        for run in runs
        if run.evaluated is not None
    ]


def _graph_curves(run: EvaluatedRun) -> list[dict[str, Any]]:
    table, found = pd.DataFrame(run.rows), []
    for graph, metrics in run.curves.items():
        own = table[table["graph"] == graph].reindex(columns=["seconds", "success_low", "success_high"])
        steps = next(iter(metrics.values())).steps
        columns = {"steps": steps, **{name: curve.values for name, curve in metrics.items()}}
        columns |= own.apply(pd.to_numeric, errors="coerce").to_dict("list")
        found.append({"name": graph, **{name: rounded(values) for name, values in columns.items()}})
    return found


def rounded(values: Sequence[float] | NDArray, digits: int = 5) -> list[float | None]:
    """Round to some significant digits, so that the page stays small; None for numbers that are not finite."""
    numbers = np.asarray(values, float).tolist()
    return [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in numbers]


def goal_row(evaluation: Evaluation) -> dict[str, Any]:
    """Return the results of an evaluation, with its goals, for the page."""
    goals = [
        {"name": name, "share": share, "mean_step": None if np.isnan(step) else step}
        for name, (share, step) in evaluation.steps_to_goals.items()
    ]
    return {
        "episodes": evaluation.episodes,
        "success": evaluation.success_rate,
        "score": evaluation.score,
        "low": evaluation.success_interval.low,
        "high": evaluation.success_interval.high,
        "length": evaluation.length,
        "over_shortest": evaluation.length_over_shortest,
        "goals": goals,
    }


def training_goals(folder: RunFolder) -> dict[str, Any] | None:
    """Return each goal with its ``shares`` of training episodes, in bins of ``steps``; None if too few episodes."""
    rows = folder.episodes.read()
    try:
        steps = np.array([float(row["steps"]) for row in rows])
        achieved = [{goal for goal in json.loads(row["goals"]) if isinstance(goal, str)} for row in rows]
    except (KeyError, ValueError, TypeError, RecursionError) as error:
        raise InputError(f"{folder.episodes.path} is broken: {error}") from error
    if len(rows) < 2 * LEAST_IN_BIN:
        return None
    bins = np.array_split(np.arange(len(rows)), min(N_BINS, len(rows) // LEAST_IN_BIN))
    names = sorted(set().union(*achieved))
    table = [np.array([name in goals for goals in achieved]) for name in names]
    shares = [(name, rounded([one[part].mean() for part in bins])) for name, one in zip(names, table, strict=True)]
    return {"steps": rounded([steps[part].mean() for part in bins]), "shares": shares}


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
    return {"graph": graph, "drop_key": drop_key, "label": f"{graph}, keys can be dropped" if drop_key else graph}
