"""Predictions of the arena's tasks, written before any of their runs."""

from __future__ import annotations

import traceback
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks.arena.families import Family
from benchmarks.prediction.play import read_rows
from hierroom.complexity.report import analyze
from hierroom.lab.advise.advise import Advice, advise
from hierroom.lab.advise.measures import Known
from hierroom.support.files import write_atomically
from hierroom.support.tables import csv_text
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.make import make_world

MILESTONES = ("steps_to_50", "steps_to_95")


def predict_rows(families: Iterable[Family], out: Path) -> None:
    """Play in each task that has no row, and write it; a task that fails has a row that says so."""
    rows: list[Mapping[str, Any]] = [*read_rows(out)]
    done = {(row["family"], row["task"]) for row in rows}
    for family in families:
        for task, entries in family.tasks().items():
            if (family.name, task) in done:
                continue
            identity = {"family": family.name, "task": task}
            try:
                rows.append(identity | predicted(entries, family.play_steps))
            except Exception as error:  # of somebody else's environment
                rows.append(identity | {"error": traceback.format_exception_only(error)[-1].strip()})
            write_atomically(out, csv_text(rows, [*dict.fromkeys(name for row in rows for name in row)]))
            print(*list(rows[-1].values())[:6], flush=True)


def predicted(entries: Mapping[str, Any], play_steps: int) -> dict[str, Any]:
    """Return what `hierroom.advise` says of a task, and what is known of it."""
    advice = advise(**entries, play_steps=play_steps)
    config = EnvConfig.of_arguments(entries)
    world = make_world(config, 1)
    try:
        rules, actions = world.rules, world.n_actions
    finally:
        world.close()
    assert advice.costs is not None
    assert rules is not None
    measures = asdict(Known.of(advice.costs, rules)) | {"hitting_time": analyze(rules).hitting_time}
    found = {
        **{"model": advice.model, "outside": advice.reason if advice.outside else "", **cells(advice)},
        **{name: f"{value:.4g}" for name, value in measures.items()},
        **{"actions": actions, "played": advice.costs.steps, "steps_per_second": round(advice.costs.steps_per_second)},
        "rules": " / ".join(str(advice.rules).splitlines()) if advice.rules else "",
    }
    return found | {"error": ""}


def cells(advice: Advice) -> dict[str, str]:
    """Return the predicted steps of each method and milestone with their interval; empty where nothing is predicted."""
    found: dict[str, str] = {}
    for method in ("hippo", "ppo-bonus", "ppo"):
        one = advice.predictions.get(method)
        for milestone in MILESTONES:
            steps = one and getattr(one, milestone)
            for end, value in (("", steps), ("_low", steps and steps.low), ("_high", steps and steps.high)):
                found[f"{method} {milestone}{end}"] = "" if value is None else f"{value:.4g}"
    return found
