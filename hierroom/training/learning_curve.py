"""The learning curve of a run: evaluations apart from training at fixed points, and the steps to a success rate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hierroom.training.evaluation import Evaluation, Score

FIRST_POINT = 0.01
"""The first evaluation after the one before training, as a share of all steps: learning is fastest at the start."""


def evaluation_points(steps: int, evaluations: int) -> list[int]:
    """After how many steps a run is evaluated: before the first step, and then at equal ratios up to the last.

    Args:
        steps: of the whole run.
        evaluations: how many besides the one before training; 0: none at all.
    """
    if evaluations == 0:
        return []
    points = np.geomspace(max(1.0, FIRST_POINT * steps), steps, evaluations) if evaluations > 1 else [steps]
    return [0, *sorted({min(steps, round(float(point))) for point in points})]


def evaluation_rows(steps: int, seconds: float, evaluation: Evaluation) -> list[dict[str, object]]:
    """An evaluation as rows of ``evaluations.csv``, one for each goal graph."""
    return [
        {"steps": steps, "seconds": round(seconds, 3), "graph": graph, **_columns(score)}
        for graph, score in evaluation.graphs.items()
    ]


def _columns(score: Score) -> dict[str, object]:
    numbers = {
        "success_rate": score.success_rate,
        "success_low": score.success_interval[0],
        "success_high": score.success_interval[1],
        "length": score.length,
        "length_over_shortest": score.length_over_shortest,
        "return": score.mean_return,
    }
    return {"episodes": score.episodes, **{name: round(value, 6) for name, value in numbers.items()}}


@dataclass(frozen=True)
class LearningCurve:
    """Success over the steps trained, over all goal graphs together.

    Args:
        steps: [P] of the evaluations, increasing.
        seconds: [P] of training until then.
        success: [P] success rates.
        length: [P] mean lengths of the episodes in primitive steps.
    """

    steps: np.ndarray
    seconds: np.ndarray
    success: np.ndarray
    length: np.ndarray

    @classmethod
    def of_rows(cls, rows: Sequence[Mapping[str, str]]) -> LearningCurve | None:
        """The curve of the rows of ``evaluations.csv``, None of no rows; several graphs count by their episodes."""
        if not rows:
            return None
        table = {name: np.array([float(row[name]) for row in rows]) for name in ("steps", "seconds", "episodes")}
        steps, first, point = np.unique(table["steps"], return_index=True, return_inverse=True)
        weights = table["episodes"]

        def mean(name: str) -> np.ndarray:
            values = np.array([float(row[name]) for row in rows])
            return np.bincount(point, weights * values, len(steps)) / np.bincount(point, weights, len(steps))

        return cls(steps, table["seconds"][first], mean("success_rate"), mean("length"))

    def first_crossing(self, percent: float) -> tuple[float, float] | None:
        """Steps and seconds at which the success rate first reached so many percent, interpolated between evaluations.

        Returns:
            (steps, seconds), or None if no evaluation reached it.
        """
        steps, seconds = (first_crossing(x, self.success, percent / 100) for x in (self.steps, self.seconds))
        return None if np.isinf(steps) else (steps, seconds)


def first_crossing(x: np.ndarray, values: np.ndarray, level: float) -> float:
    """Where values first reach a level, by straight lines between them.

    Args:
        x: [P] where the values are, such as steps; increasing.
        values: [P] the values; NaN where there is none.
        level: to be reached.

    Returns:
        a place between the first x and the last; infinity if no value is as high.
    """
    reached = np.flatnonzero(values >= level)
    if not len(reached):
        return np.inf
    after = reached[0]
    if after == 0 or np.isnan(values[after - 1]):
        return float(x[after])
    (low, high), (start, end) = values[after - 1 : after + 1], x[after - 1 : after + 1]
    return float(start + (level - low) / (high - low) * (end - start))
