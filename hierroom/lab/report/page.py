"""The report as one HTML file: templates filled with escaped texts, data as JSON, and the chart library."""

from __future__ import annotations

import base64
import gzip
from collections.abc import Mapping, Sequence
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from hierroom.agents.evaluation import outcome_in_words
from hierroom.lab.compare.evaluated_run import plain_entries
from hierroom.lab.compare.grouping import shortened
from hierroom.lab.compare.style import line_style
from hierroom.lab.report.curves import Curves, known_measures
from hierroom.lab.report.runs import ReportedRun
from hierroom.meta import LEARNED
from hierroom.runs.config.config import OF_META
from hierroom.runs.config.presets import preset_in_world
from hierroom.runs.logs.learning_curve import LearningCurve
from hierroom.support.cells import join_names
from hierroom.support.files import to_json
from hierroom.worlds.env_config import OF_ESCAPE_ROOMS

_ORIGIN = ("started", "command", "python", "cpu", "platform")


def render_page(texts: Mapping[str, Any], data: Mapping[str, Any]) -> bytes:
    """Fill the templates with escaped texts, and with plain data for the page's scripts; return the page in UTF-8."""
    from plotly.offline import get_plotlyjs

    plotly = base64.b64encode(gzip.compress(get_plotlyjs().encode(), 9, mtime=0)).decode()
    loader = PackageLoader("hierroom.lab.report", "templates")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    page = environment.get_template("page.html")
    return page.render(**texts, shown=data, data=script_json(data), plotly=plotly).encode("utf-8", "replace")


def script_json(value: Any) -> Markup:
    """Return plain types as JSON for a script element, escaped so that it cannot end the element or begin another."""
    text = to_json(value, indent=None)
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return Markup(text)


def page_texts(
    runs: Sequence[ReportedRun],
    curves: Curves,
    complexity: Sequence[Mapping[str, Any]],
    points: Sequence[Mapping[str, Any]],
    notes: Sequence[str],
) -> dict[str, Any]:
    """Return the texts of the page's tables."""
    has_meta = any(run.config.resolved_method.meta == LEARNED for run in runs)
    has_variant = any(run.entries["variant"] for run in runs)
    names = [name for name in runs[0].entries if has_meta or not name.startswith(OF_META)]
    names = [name for name in names if has_variant or name != "variant"]
    if all(run.config.env.task is not None for run in runs):
        names = [name for name in names if name not in OF_ESCAPE_ROOMS]
    measures = known_measures(complexity)
    differing = [name for name in names if len({_text(run.entries.get(name)) for run in runs}) > 1]
    shown = [*(name for name in curves.by if name in differing and name != "graph"), "seed"]
    default = plain_entries(preset_in_world("default", runs[0].config.env))
    steps_of = {(p["graph"], p["drop_key"], p["group"]): p["steps_to"].get("95") for p in points}
    groups = sorted({point["group"] for point in points})
    evaluated = [run.evaluated for run in runs if run.evaluated is not None]
    return {
        "outcome": " or ".join(sorted({one.outcome.removesuffix("_rate") for one in evaluated})),
        "runs": [_run(run, curves, shown, differing) for run in runs],
        "differing": shown,
        "common": [
            {"name": name, "value": _text(value), "is_other": default.get(name) != value}
            for name, value in runs[0].entries.items()
            if name in names and name not in differing
        ],
        "measure_names": [*measures.values()],
        "steps_labels": [curves.labels[group] for group in groups],
        "complexity": [
            {
                "name": row["label"],
                "cells": [*(_number(row["measures"][name]) for name in measures)]
                + [_number(steps_of.get((row["graph"], row["drop_key"], group))) for group in groups],
            }
            for row in complexity
        ],
        "notes": list(notes),
    }


def _run(run: ReportedRun, curves: Curves, shown: Sequence[str], differing: Sequence[str]) -> dict[str, Any]:
    last: dict[str, str] = dict.fromkeys(("steps", "success", "interval", "length"), "-")
    rows = run.evaluated.rows if run.evaluated is not None else []
    curve = LearningCurve.of_rows(rows)
    if curve is not None:
        final = [row for row in rows if float(row["steps"]) == curve.steps[-1]]
        last = {
            "steps": f"{curve.steps[-1]:,.0f}",
            "success": outcome_in_words(*curve.last, digits=1)[1],
            "interval": _interval(final[0]) if len(final) == 1 else "-",
            "length": f"{curve.length[-1]:.1f}",
        }
    return {
        "name": run.name,
        "path": str(run.path),
        "graph": shortened([*(run.graphs or run.names)], 3),
        "colour": line_style(curves.group_of[str(run.path)])[0],
        "differing": [run.evaluated.choice(name) if run.evaluated else _text(run.entries.get(name)) for name in shown],
        "others": ", ".join(f"{name} {_text(run.entries.get(name))}" for name in differing if name not in shown),
        "origin": _origin(run),
        **last,
    }


def _interval(row: Mapping[str, str]) -> str:
    try:
        return f"{float(row['success_low']):.1%} to {float(row['success_high']):.1%}".replace("nan% to nan%", "-")
    except (KeyError, ValueError):
        return "-"


def _origin(run: ReportedRun) -> list[tuple[str, str]]:
    lines = []
    for number, session in enumerate(run.sessions, start=1):
        which = f" {number}" if len(run.sessions) > 1 else ""
        lines += [(f"{name}{which}", _text(session[name])) for name in _ORIGIN if session.get(name)]
        ours = session.get("hierroom")
        commit = ours.get("git") if isinstance(ours, Mapping) else None
        if isinstance(commit, Mapping):
            changed = ", with changes" if commit.get("is_dirty") else ""
            lines.append((f"commit{which}", f"{_text(commit.get('commit'))}{changed}"))
        if isinstance(packages := session.get("packages"), Mapping):
            lines.append((f"packages{which}", ", ".join(f"{name} {version}" for name, version in packages.items())))
    return lines


def _number(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:,.0f}" if value >= 1000 or value == int(value) else f"{value:,.2f}"


def _text(value: Any) -> str:
    return join_names(map(str, value), ", ") if isinstance(value, (list, tuple)) else str(value)
