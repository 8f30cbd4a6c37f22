"""Success and steps to each goal: of the trained agents, played for the report, and of training's own episodes."""

from __future__ import annotations

from typing import Any

import numpy as np

from hierroom.goals import ROOM_GOAL_NAMES
from hierroom.lab.report.curves import rounded
from hierroom.runs.evaluation import Evaluation
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.support.errors import InputError

N_BINS, LEAST_IN_BIN = 40, 10  # points of a curve at most, and episodes of each at least


def goal_row(evaluation: Evaluation) -> dict[str, Any]:
    """Return what trained agents achieved, for the page."""
    goals = [
        {"name": name, "share": share, "mean_step": None if np.isnan(step) else step}
        for name, (share, step) in evaluation.steps_to_goals.items()
    ]
    return {
        "episodes": evaluation.episodes,
        "success": evaluation.success_rate,
        "low": evaluation.success_interval.low,
        "high": evaluation.success_interval.high,
        "length": evaluation.length,
        "over_shortest": evaluation.length_over_shortest,
        "goals": goals,
        "graphs": {name: [score.success_rate, score.length] for name, score in evaluation.graphs.items()},
    }


def training_goals(folder: RunFolder) -> dict[str, Any] | None:
    """Return the ``shares`` of training's episodes that achieved each goal, in bins of ``steps``; None for few."""
    try:
        rows = folder.episodes.read()
        steps = np.array([float(row["steps"]) for row in rows])
        achieved = [set(row["goals"].split(" > ")) for row in rows]
    except (InputError, OSError, KeyError, ValueError):
        return None
    if len(rows) < 2 * LEAST_IN_BIN:
        return None
    bins = np.array_split(np.arange(len(rows)), min(N_BINS, len(rows) // LEAST_IN_BIN))
    names = [name for name in ROOM_GOAL_NAMES if any(name in goals for goals in achieved)]
    table = {name: np.array([name in goals for goals in achieved]) for name in names}
    shares = {name: rounded([reached[part].mean() for part in bins]) for name, reached in table.items()}
    return {"steps": rounded([steps[part].mean() for part in bins]), "shares": shares}
