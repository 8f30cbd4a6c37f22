"""Read runs and their evaluations during training from their folders."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pandas as pd

from hierroom.goals import GoalGraph, graph_specs, spec_names
from hierroom.goals.alternatives import first_names
from hierroom.goals.goal_set import column_name
from hierroom.lab.compare.curve import ACHIEVED, METRICS, OUTCOMES, Curve, MetricName
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.config_file import OF_ENVIRONMENTS
from hierroom.runs.folder.predicted import Prediction, prediction_of
from hierroom.runs.folder.provenance import code_of, variant_of
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.support.cells import join_names
from hierroom.support.errors import InputError, one_line, shown
from hierroom.support.files import usable_path

_TABLE = "evaluations.csv"
T = TypeVar("T")


@dataclass(frozen=True)
class EvaluatedRun:
    """A training run and its evaluations."""

    path: Path
    rows: Sequence[Mapping[str, str]]  # of its table of evaluations
    entries: Mapping[str, Any]  # see `entries_of`
    meta: str
    reward: str  # the controller's reward
    curves: Mapping[str, Mapping[str, Curve]]  # by goal graph and metric; see `read_run`
    episodes: frozenset[int]  # the different numbers of episodes of its evaluations, over all graphs
    user_graphs: Mapping[str, object]  # by name, what identifies each user-defined goal graph, layout or task
    code: Mapping[str, frozenset[str]]  # see `provenance.code_of`
    prediction: Prediction | None = None  # of advice, before the run began

    @property
    def kind(self) -> str:
        """The source of its levels: ``task``, ``layout`` or ``graph``."""
        return next((kind for kind in ("task", "layout") if self.entries.get(kind)), "graph")

    @property
    def outcome(self) -> MetricName:
        """Return the outcome that counts in the run: see `OUTCOMES`."""
        return next(name for name in OUTCOMES if name == OUTCOMES[-1] or self.knows(name))

    def knows(self, metric: MetricName) -> bool:
        """Return whether a metric has values."""
        curves = (metrics[metric] for metrics in self.curves.values() if metric in metrics)
        return any(np.isfinite(curve.values).any() for curve in curves)

    @property
    def evaluated_steps(self) -> float:
        """Steps trained at the last evaluation, of whatever graphs."""
        return max(float(row["steps"]) for row in self.rows)

    @property
    def first_steps(self) -> float:
        """Steps trained at the first evaluation from which all its graphs have values."""
        return max(curve.steps[0] for metrics in self.curves.values() for curve in metrics.values())

    @property
    def last_steps(self) -> float:
        """Steps trained at the last evaluation up to which all its graphs have values."""
        return min(curve.steps[-1] for metrics in self.curves.values() for curve in metrics.values())

    def choice(self, name: str) -> str:
        """Return an entry of the config as a line of text; ``warm_start`` becomes that run's name without its seed."""
        text = self._text(name)
        line = one_line(text)  # it is shown, and the folder is untrusted
        return line if len(text) <= len(line) else f"{line} ({hashlib.sha256(text.encode()).hexdigest()[:6]})"

    def _text(self, name: str) -> str:
        if name in ("meta", "reward"):
            return str(getattr(self, name))
        if name == "task" and self.kind == "task":
            return ", ".join(self.curves)  # the task's label, if it has one
        value = self.entries[name]
        if name == "warm_start" and value:
            # Remove the seed, and the suffix that a sweep or a second run of that name adds.
            head, *rest = re.split(r"-seed\d+(?=-|$)", Path(value).name, maxsplit=1)
            return head + re.sub(r"-([0-9a-f]{6}|\d+)$", "", "".join(rest)) if rest else head
        return join_names(map(str, value), ",") if isinstance(value, (list, tuple)) else str(value)


def known_metrics(runs: Iterable[EvaluatedRun]) -> list[MetricName]:
    """Return the metrics of runs, the usual one first: the success rate, or the score, or the return."""
    outcomes = {run.outcome for run in runs}
    return [name for name in METRICS if name not in OUTCOMES[:-1] or name in outcomes]


def metric_named(asked: str, runs: Sequence[EvaluatedRun]) -> MetricName:
    """Return the metric that a user names: one of `METRICS`, or the name of a goal of all the runs."""
    column, words = column_name(asked), column_name(asked).replace("-", "_")
    by_run = [{name for curves in run.curves.values() for name in curves if run.knows(name)} for run in runs]
    known = {*set.intersection(*by_run), *known_metrics(runs)}
    names = words, column, f"{ACHIEVED}{column}"
    if (found := next((name for name in names if name in known), None)) is None:
        goals = [name.removeprefix(ACHIEVED) for name in sorted(known - {*METRICS})]
        metrics = ", ".join(name for name in METRICS if name in known)
        raise InputError(f"--outcome is one of {metrics} or a goal ({first_names(goals)}), not {shown(asked)}")
    return found


def find_runs(paths: Iterable[Path]) -> tuple[list[Path], list[Path]]:
    """Return the runs at or inside some paths, each once, and the runs inside that have no learning curve."""
    found: dict[Path, Path] = {}
    left_out = []
    for path in paths:
        for one in runs_inside(path):
            if one == path or _has_curve(one):
                found.setdefault(one.resolve(), one)
            else:
                left_out.append(one)
    return list(found.values()), left_out


def read_each(paths: Iterable[Path], read: Callable[[Path], T]) -> tuple[list[T], list[str]]:
    """Return the runs that can be read, and a line for each other one; raise an error if none can be read."""
    runs, left_out = [], []
    for path in paths:
        try:
            runs.append(read(path))
        except InputError as error:
            left_out.append(f"left out: {error}")
    if not runs:
        raise InputError("; ".join(line.removeprefix("left out: ") for line in left_out) or "there are no runs")
    return runs, left_out


def runs_inside(path: Path) -> list[Path]:
    """Return a run's folder, or those in a folder or its ``runs``."""
    if (usable_path(path) / "config.json").is_file():
        return [path]
    for pattern in ("*/config.json", "runs/*/config.json") if path.is_dir() else ():
        if inside := sorted(path.glob(pattern)):
            return [config.parent for config in inside]
    raise InputError(f"{path} is neither a run folder (it has no config.json) nor a folder that contains some")


def _has_curve(path: Path) -> bool:
    try:
        return any(float(row.get("steps", 0)) > 0 for row in RunFolder(path).evaluations.read())
    except InputError:
        return True


def read_run(path: Path) -> EvaluatedRun:
    """Read the config and the evaluations of a run.

    Evaluations of failing agents have fewer episodes, and of many graphs not each has one: a graph that was met in only
    one of several evaluations has no curve.
    """
    folder = RunFolder.open(path)
    config, rows = folder.config(), folder.evaluations.read()
    if not rows:
        why = "the run was made without evaluations, or none has been written yet"
        raise InputError(f"{folder.path} has no {_TABLE}; {why}")
    rows = [{**row, "graph": one_line(row["graph"])} for row in rows]  # it is shown, and the folder is untrusted
    metrics = [*METRICS, *(name for name in rows[0] if name.startswith(ACHIEVED))]
    numbers, curves = ["steps", "episodes", *metrics], {}
    table = pd.DataFrame(rows, dtype=object).reindex(columns=["graph", *numbers]).replace("", np.nan)
    table = table.astype(dict.fromkeys(numbers, float))
    is_curve = table.groupby("graph")["steps"].transform("size") > 1
    for graph, own in (table[is_curve] if is_curve.any() else table).groupby("graph", sort=False):
        steps = own["steps"].to_numpy()
        if not (np.diff(steps) > 0).all() or not np.isfinite(steps).all():
            raise InputError(f"{path / _TABLE} is broken: the steps of graph {graph} do not increase from row to row")
        curves[graph] = {name: Curve(steps, own[name].to_numpy()) for name in metrics}
    method = config.resolved_method
    counts = frozenset(map(int, table.groupby("steps")["episodes"].sum()))
    graphs: dict[str, object] = {one.name: one.rows for one in config.env.layout} or {
        spec.name: spec.canonical() for spec in graph_specs(config.env.graph) if isinstance(spec, GoalGraph)
    }
    if config.env.task is not None:
        graphs = dict.fromkeys(curves, config.env.task)  # two tasks may have the same label
    entries, reward = entries_of(path, config), str(method.reward)
    of_folder = code_of(path), prediction_of(path)
    return EvaluatedRun(path, rows, entries, method.meta, reward, curves, counts, graphs, *of_folder)


def refuse_without_overlap(runs: Sequence[EvaluatedRun]) -> None:
    """Refuse runs if the last evaluation of one comes before the first of another."""
    start, end = max(run.first_steps for run in runs), min(run.last_steps for run in runs)
    if start >= end:
        short = min(runs, key=lambda run: run.last_steps)
        only = f"{short.path} was evaluated up to {short.last_steps:,.0f} steps only"
        raise InputError(f"{only}, before the other curves begin; leave it out, or --resume it")


def entries_of(path: Path, config: TrainConfig) -> dict[str, Any]:
    """Return the entries of a run's config by flat names, and ``variant``, its name in a sweep's plan."""
    return plain_entries(config) | {"variant": variant_of(path)}


def plain_entries(config: TrainConfig) -> dict[str, Any]:
    """Return the entries of a config by their flat names, with names instead of goal graphs and layouts."""
    graphs = {"graph": [*config.env.names], "exclude": [*spec_names(config.env.exclude)]}
    graphs["layout"] = [one.name for one in config.env.layout]
    return {name: value for name, value in (config.entries | graphs).items() if name not in OF_ENVIRONMENTS}
