"""The metrics of ``evaluations.csv``, and their learning curves: values at some steps, interpolated linearly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierroom.runs.logs.learning_curve import first_crossing

MetricName = str
"""One of `METRICS`, or ``achieved_GOAL``, the share of episodes that achieved a goal."""
ACHIEVED = "achieved_"


@dataclass(frozen=True)
class Metric:
    """A column of ``evaluations.csv``."""

    label: str
    is_higher_better: bool = True
    is_rate: bool = False  # a fraction, shown in percent
    digits: int = 1  # digits shown after the decimal point

    @property
    def scale(self) -> float:
        """The factor by which values are multiplied when they are shown."""
        return 100.0 if self.is_rate else 1.0


METRICS: Mapping[MetricName, Metric] = {
    "success_rate": Metric("success rate", is_rate=True),
    "score": Metric("score over all goals", is_rate=True),
    "return": Metric("return of the controller", digits=2),
    "length": Metric("episode length (steps)", is_higher_better=False),
    "length_over_shortest": Metric("length / shortest", is_higher_better=False, digits=2),
}
OUTCOMES = "success_rate", "score", "return"
"""Outcomes that may count in a run: the first one that it knows does."""


def metric_of(name: MetricName) -> Metric:
    """Return a metric by its name."""
    return METRICS.get(name) or Metric(f"episodes with {name.removeprefix(ACHIEVED)}", is_rate=True)


@dataclass(frozen=True)
class Curve:
    """A metric over the steps trained, linear between the evaluations."""

    steps: NDArray[np.float64]  # [P] float, steps trained at each evaluation, increasing
    values: NDArray[np.float64]  # [P] float, the metric at these steps; NaN if it has no value

    def at(self, steps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values [Q] at some steps [Q] between the first evaluation and the last."""
        return np.interp(steps, self.steps, self.values)

    def between(self, start: float, end: float) -> Curve:
        """Return the part of the curve between two numbers of steps inside its range."""
        inside = self.steps[(start < self.steps) & (self.steps < end)]
        steps = np.array([start, *inside, end], float)
        return Curve(steps, self.at(steps))

    @property
    def area(self) -> float:
        """The area divided by the number of steps: ``sum((t[i+1] - t[i]) * (v[i] + v[i+1]) / 2) / (t[-1] - t[0])``."""
        return float(np.trapezoid(self.values, self.steps) / (self.steps[-1] - self.steps[0]))

    def steps_to(self, level: float) -> float:
        """Return the steps at which the curve reaches a level, see `first_crossing`; else infinity."""
        return first_crossing(self.steps, self.values, level)


def shared_steps(curves: Sequence[Curve]) -> NDArray[np.float64]:
    """Return the steps [Q] of all evaluations, in the range of steps that all curves cover."""
    start, end = max(curve.steps[0] for curve in curves), min(curve.steps[-1] for curve in curves)
    steps = np.unique(np.concatenate([curve.steps for curve in curves]))
    return steps[(start <= steps) & (steps <= end)]


def mean_curve(curves: Sequence[Curve]) -> Curve:
    """Return the mean of some curves, over the steps that all of them have."""
    steps = shared_steps(curves)
    return Curve(steps, np.mean([curve.at(steps) for curve in curves], axis=0))
