"""The runs of a report: their config, origin and evaluations."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from hierroom.complexity.graph_set import GraphSet
from hierroom.goals import GoalGraph
from hierroom.lab.compare.evaluated_run import EvaluatedRun, entries_of, read_run, runs_inside
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.support.errors import InputError


@dataclass(frozen=True)
class ReportedRun:
    """A run as the report shows it."""

    path: Path
    config: TrainConfig
    entries: Mapping[str, Any]  # as in `EvaluatedRun`
    evaluated: EvaluatedRun | None  # None without an evaluation after the first step
    sessions: list[dict[str, Any]]  # of ``provenance.json``; none if that cannot be read

    @property
    def name(self) -> str:
        """The name of its folder."""
        return self.path.resolve().name

    @cached_property
    def graphs(self) -> dict[str, GoalGraph]:
        """The goal graphs it trained on, by their names, the easiest first; of a task none."""
        env = self.config.env
        if env.task is not None:
            return {}
        (ranked,) = GraphSet(env.graph, env.exclude, env.drop_key).stages(1)
        return {graph.name: graph for graph in ranked}


def read_runs(paths: Iterable[Path]) -> tuple[list[ReportedRun], list[str]]:
    """Read the runs among some paths, see `runs_inside`, each once; and return notes on what could not be read."""
    found = {one.resolve(): one for path in paths for one in runs_inside(path)}
    runs, notes = [], []
    for path in found.values():
        try:
            runs.append(_read(path, notes))
        except InputError as error:
            if len(found) == 1:
                raise
            notes.append(f"left out: {error}")
    if not runs:
        raise InputError("; ".join(notes) or "give the folders of the runs, or a folder that contains them")
    return runs, notes


def _read(path: Path, notes: list[str]) -> ReportedRun:
    config = RunFolder.open(path).config()
    evaluated = None
    try:
        evaluated = read_run(path)
        if evaluated.last_steps <= evaluated.first_steps:
            evaluated = None
            notes.append(f"{path} was evaluated only once so far: it has no learning curve")
    except InputError as error:
        notes.append(f"no learning curve: {error}")
    return ReportedRun(path, config, entries_of(path, config), evaluated, _sessions(path, notes))


def _sessions(path: Path, notes: list[str]) -> list[dict[str, Any]]:
    try:
        sessions = json.loads((path / "provenance.json").read_text())["sessions"]
        return [session for session in sessions if isinstance(session, dict)]
    except FileNotFoundError:
        return []
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        notes.append(f"{path / 'provenance.json'} cannot be read: {error}")
        return []
