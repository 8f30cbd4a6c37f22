"""The numbers that loggers show of a run, in groups."""

from __future__ import annotations

from collections.abc import Mapping

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.evaluation import Evaluation, Score
from hierroom.runs.logs.learning_curve import MILESTONES, LearningCurve

Plain = bool | int | float | str

GROUPS: Mapping[str, tuple[str, ...]] = {
    "time": ("seconds", "compile_seconds", "steps_per_second"),
    "train": ("episodes", "success_rate", "episode_length", "episode_return", "stage"),
}
"""The tags of the entries of ``metrics.csv`` begin with these; those of others with the agent that they tell of."""


def tag(name: str) -> str:
    """The tag of an entry of ``metrics.csv``: that of ``meta_entropy`` is ``meta/entropy``."""
    for group, names in GROUPS.items():
        if name in names:
            return f"{group}/{name}"
    return f"meta/{name.removeprefix('meta_')}" if name.startswith("meta_") else f"controller/{name}"


def metric_scalars(row: Mapping[str, float]) -> dict[str, float]:
    """A row of ``metrics.csv`` by tags, but for its steps."""
    return {tag(name): value for name, value in row.items() if name != "steps"}


def evaluation_scalars(evaluation: Evaluation) -> dict[str, float]:
    """An evaluation by tags: in all, by goal, and where there are several goal graphs by graph."""
    scalars = _of_score("eval", evaluation)
    for goal, (share, _) in evaluation.steps_to_goals.items():
        scalars[f"eval/achieved/{goal.replace(' ', '_')}"] = share
    if len(evaluation.graphs) > 1:
        for graph, score in evaluation.graphs.items():
            scalars |= _of_score(f"eval/graph/{graph}", score)
    return scalars


def _of_score(group: str, score: Score) -> dict[str, float]:
    numbers = {"success_rate": score.success_rate, "length": score.length, "return": score.mean_return}
    numbers["length_over_shortest"] = score.length_over_shortest
    return {f"{group}/{name}": value for name, value in numbers.items()}


def hyperparameters(config: TrainConfig) -> dict[str, Plain]:
    """Return the entries of a config as loggers show them."""
    return {name: one if isinstance(one, (bool, int, float, str)) else str(one) for name, one in config.entries.items()}


def result_scalars(curve: LearningCurve | None) -> dict[str, float]:
    """How a run ended, by tags: its last evaluation, and the steps to each success rate that it reached."""
    if curve is None:
        return {}
    crossings = {milestone: curve.crossing(milestone) for milestone in MILESTONES}
    ends = {"eval/success_rate": float(curve.success[-1]), "eval/length": float(curve.length[-1])}
    return ends | {f"eval/steps_to_{name}": at.steps for name, at in crossings.items() if at is not None}
