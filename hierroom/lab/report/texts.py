"""What the report says in words and tables; the page shows every character as it is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from hierroom.lab.compare.evaluated_run import flat_entries
from hierroom.lab.compare.grouping import shortened
from hierroom.lab.compare.style import line_style
from hierroom.lab.report.curves import Curves
from hierroom.lab.report.difficulty import MEASURES
from hierroom.lab.report.runs import ReportedRun
from hierroom.meta import LEARNED
from hierroom.runs.config.config import OF_META, TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.logs.learning_curve import LearningCurve

_ORIGIN = ("started", "command", "python", "cpu", "platform")


def page_texts(
    runs: Sequence[ReportedRun],
    curves: Curves,
    goals: Sequence[Mapping[str, Any]],
    complexity: Sequence[Mapping[str, Any]],
    points: Sequence[Mapping[str, Any]],
    notes: Sequence[str],
) -> dict[str, Any]:
    """The texts of the page's tables; ``goals`` are rows of `goal_row`, each with its ``run``, and ``notes`` lines."""
    names = _told(runs)
    differing = [name for name in names if len({_text(run.entries.get(name)) for run in runs}) > 1]
    shown = [*(name for name in curves.by if name in differing and name != "graph"), "seed"]
    default = flat_entries(TrainConfig())
    steps_of: dict[tuple[str, int], Any] = {(p["label"], p["group"]): p["steps_to"].get("95") for p in points}
    groups = sorted({point["group"] for point in points})
    return {
        "runs": [_run(run, curves, shown, differing) for run in runs],
        "differing": shown,
        "common": [
            {
                "name": name,
                "value": _text(runs[0].entries[name]),
                "is_other": default.get(name) != runs[0].entries[name],
            }
            for name in names
            if name not in differing
        ],
        "goals": [_goals(row) for row in goals],
        "measure_names": [*MEASURES.values()],
        "steps_labels": [curves.labels[group] for group in groups],
        "complexity": [
            {
                "name": row["label"],
                "cells": [*(_number(row["measures"][name]) for name in MEASURES)]
                + [_number(steps_of.get((row["label"], group))) for group in groups],
            }
            for row in complexity
        ],
        "notes": list(notes),
    }


def _told(runs: Sequence[ReportedRun]) -> list[str]:
    """The names of the entries that are told: not those of a learner, nor a variant, that no run has."""
    has_meta, has_variant = any(run.meta == LEARNED for run in runs), any(run.entries["variant"] for run in runs)
    names = [name for name in runs[0].entries if has_meta or not name.startswith(OF_META)]
    return [name for name in names if has_variant or name != "variant"]


def _run(run: ReportedRun, curves: Curves, shown: Sequence[str], differing: Sequence[str]) -> dict[str, Any]:
    last: dict[str, str] = dict.fromkeys(("steps", "success", "interval", "length"), "-")
    rows = RunFolder(run.path).evaluations.read() if run.evaluated is not None else []
    curve = LearningCurve.of_rows(rows)
    if curve is not None:
        final = [row for row in rows if float(row["steps"]) == curve.steps[-1]]
        last = {
            "steps": f"{curve.steps[-1]:,.0f}",
            "success": f"{curve.success[-1]:.1%}",
            "interval": _interval(final[0]) if len(final) == 1 else "-",
            "length": f"{curve.length[-1]:.1f}",
        }
    return {
        "name": run.name,
        "path": str(run.path),
        "graph": shortened([*run.graphs], 3),
        "colour": line_style(curves.group_of[str(run.path)])[0],
        "differing": [run.evaluated.choice(name) if run.evaluated else _text(run.entries.get(name)) for name in shown],
        "others": ", ".join(f"{name} {_text(run.entries.get(name))}" for name in differing if name not in shown),
        "origin": _origin(run),
        **last,
    }


def _interval(row: Mapping[str, str]) -> str:
    try:
        return f"{float(row['success_low']):.1%} to {float(row['success_high']):.1%}"
    except (KeyError, ValueError):
        return "-"


def _origin(run: ReportedRun) -> list[tuple[str, str]]:
    """What is told of where a run came from: name and text."""
    told = []
    for number, session in enumerate(run.sessions, start=1):
        which = f" {number}" if len(run.sessions) > 1 else ""
        told += [(f"{name}{which}", _text(session[name])) for name in _ORIGIN if session.get(name)]
        ours = session.get("hierroom")
        commit = ours.get("git") if isinstance(ours, Mapping) else None
        if isinstance(commit, Mapping):
            changed = ", with changes" if commit.get("is_dirty") else ""
            told.append((f"commit{which}", f"{_text(commit.get('commit'))}{changed}"))
        if isinstance(packages := session.get("packages"), Mapping):
            told.append((f"packages{which}", ", ".join(f"{name} {version}" for name, version in packages.items())))
    return told


def _goals(row: Mapping[str, Any]) -> dict[str, str]:
    return {
        "run": row["run"],
        "episodes": str(row["episodes"]),
        "success": f"{row['success']:.1%} ({row['low']:.1%} to {row['high']:.1%})",
        "length": f"{row['length']:.1f}",
        "over_shortest": "-" if math.isnan(row["over_shortest"]) else f"{row['over_shortest']:.2f}",
        "goals": ", ".join(
            f"{goal['name']}: {'never' if goal['mean_step'] is None else format(goal['mean_step'], '.1f')} "
            f"({goal['share']:.0%})"
            for goal in row["goals"]
        ),
    }


def _number(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:,.0f}" if value >= 1000 or value == int(value) else f"{value:,.2f}"


def _text(value: Any) -> str:
    return (", ".join(map(str, value)) or "none") if isinstance(value, (list, tuple)) else str(value)
