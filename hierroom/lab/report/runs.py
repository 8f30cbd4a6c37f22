"""The runs of a report: their config, origin and evaluations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from hierroom.complexity.graph_set import GraphSet
from hierroom.goals import GoalGraph
from hierroom.lab.compare.evaluated_run import EvaluatedRun, entries_of, read_each, read_run, runs_inside
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.provenance import read_sessions
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.support.errors import InputError


@dataclass(frozen=True)
class ReportedRun:
    """A run as the report shows it."""

    path: Path
    config: TrainConfig
    entries: Mapping[str, Any]  # as in `EvaluatedRun`
    evaluated: EvaluatedRun | None  # None without a learning curve
    sessions: list[dict[str, Any]]  # from ``provenance.json``

    @property
    def name(self) -> str:
        """The name of its folder."""
        return self.path.resolve().name

    @property
    def names(self) -> tuple[str, ...]:
        """The names of what it plays: a task's label, which its evaluations have, or those of its config."""
        is_task = self.config.env.task is not None
        return tuple(self.evaluated.curves) if is_task and self.evaluated else self.config.env.names

    @cached_property
    def graphs(self) -> dict[str, GoalGraph]:
        """The goal graphs of its training, by the names of graphs or layouts, the easiest first; none for a task."""
        env = self.config.env
        if env.layout:
            return {one.name: one.graph for one in env.layout}
        if env.task is not None:
            return {}
        (ranked,) = GraphSet(env.graph, env.exclude, env.drop_key).stages(1)
        return {graph.name: graph for graph in ranked}


def read_runs(paths: Iterable[Path]) -> tuple[list[ReportedRun], list[str]]:
    """Return the runs among some paths, see `runs_inside`, each once, and notes on runs that could not be read."""
    found = {one.resolve(): one for path in paths for one in runs_inside(path)}
    notes: list[str] = []
    runs, left_out = read_each(found.values(), lambda path: _read(path, notes))
    return runs, notes + left_out


def _read(path: Path, notes: list[str]) -> ReportedRun:
    config = RunFolder.open(path).config()
    entries = entries_of(path, config)
    sessions = [session for session in read_sessions(path) if isinstance(session, dict)]
    evaluated = None
    try:
        evaluated = read_run(path)
        if evaluated.last_steps <= evaluated.first_steps:
            evaluated = None
            notes.append(f"{path} was evaluated only once so far: it has no learning curve")
    except InputError as error:
        notes.append(f"no learning curve: {error}")
    return ReportedRun(path, config, entries, evaluated, sessions)
