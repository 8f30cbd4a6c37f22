"""The numbers of a run in groups, as loggers show them, and the protocol of a logger."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Protocol

from hierroom.agents.evaluation import Evaluation, Score
from hierroom.goals.goal_set import column_name
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.logs.learning_curve import MILESTONES, LearningCurve

Plain = bool | int | float | str


class Logger(Protocol):
    """Shows the numbers of a run somewhere. If it raises an error, training goes on without it."""

    label: str
    """Its name in a warning."""

    def add(self, scalars: Mapping[str, float], steps: int) -> None:
        """Show numbers by tags, such as ``eval/success_rate``, after ``steps`` primitive steps."""
        ...

    def add_results(self, hyperparameters: Mapping[str, Plain], results: Mapping[str, float], steps: int) -> None:
        """Show hyperparameters and results."""
        ...

    def close(self, *, is_done: bool) -> None:
        """End a session; if the run is not done, it may be resumed."""


GROUPS: Mapping[str, tuple[str, ...]] = {
    "time": ("seconds", "compile_seconds", "steps_per_second"),
    "train": ("episodes", "success_rate", "episode_length", "episode_return", "score", "stage"),
}
"""Groups of entries of ``metrics.csv``; other entries are grouped by their agents."""


def tag(name: str) -> str:
    """Return the tag of an entry of ``metrics.csv``, such as ``meta/entropy`` for ``meta_entropy``."""
    for group, names in GROUPS.items():
        if name in names:
            return f"{group}/{name}"
    return f"meta/{name.removeprefix('meta_')}" if name.startswith("meta_") else f"controller/{name}"


def metric_scalars(row: Mapping[str, float]) -> dict[str, float]:
    """Return a row of ``metrics.csv`` by tags, without its steps."""
    return {tag(name): value for name, value in row.items() if name != "steps"}


def evaluation_scalars(evaluation: Evaluation) -> dict[str, float]:
    """Return an evaluation by tags: over all episodes, for each goal, and for each goal graph if there are several."""
    scalars = _of_score("eval", evaluation)
    for goal, (share, _) in evaluation.steps_to_goals.items():
        scalars[f"eval/achieved/{column_name(goal)}"] = share
    if len(evaluation.graphs) > 1:
        for graph, score in evaluation.graphs.items():
            scalars |= _of_score(f"eval/graph/{graph}", score)
    return scalars


def _of_score(group: str, score: Score) -> dict[str, float]:
    numbers = {"success_rate": score.success_rate, "length": score.length, "return": score.mean_return}
    numbers["length_over_shortest"] = score.length_over_shortest
    numbers |= {} if math.isnan(score.score) else {"score": score.score}
    return {f"{group}/{name}": value for name, value in numbers.items()}


def hyperparameters(config: TrainConfig) -> dict[str, Plain]:
    """Return the entries of a config as loggers show them."""
    return {name: one if isinstance(one, (bool, int, float, str)) else str(one) for name, one in config.entries.items()}


def result_scalars(curve: LearningCurve | None) -> dict[str, float]:
    """Return the last evaluation of a run and the steps to each success rate or score that it reached, by tags."""
    if curve is None:
        return {}
    crossings = {milestone: curve.crossing(milestone) for milestone in MILESTONES}
    ends = {f"eval/{curve.outcome_name}": float(curve.outcome[-1]), "eval/length": float(curve.length[-1])}
    return ends | {f"eval/steps_to_{name}": at.steps for name, at in crossings.items() if at is not None}
