"""A learning curve: values at some numbers of steps, and straight lines in between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierroom.runs.logs.learning_curve import first_crossing


@dataclass(frozen=True)
class Curve:
    """A metric over the steps trained, linear between the evaluations."""

    steps: NDArray[np.float64]  # [P] float, steps trained at each evaluation, increasing
    values: NDArray[np.float64]  # [P] float, the metric there; NaN where it has no value

    def at(self, steps: NDArray[np.float64]) -> NDArray[np.float64]:
        """[Q] the values after some numbers of steps [Q], which lie between the first evaluation and the last."""
        return np.interp(steps, self.steps, self.values)

    def between(self, start: float, end: float) -> Curve:
        """The part of the curve from ``start`` to ``end`` steps; both lie between its first and its last evaluation."""
        inside = self.steps[(start < self.steps) & (self.steps < end)]
        steps = np.array([start, *inside, end], float)
        return Curve(steps, self.at(steps))

    @property
    def area(self) -> float:
        """The area under the curve over its number of steps, which is the mean value on the way.

        By the trapezoidal rule, which is exact as the curve is linear between its points:
        ``sum((t[i+1] - t[i]) * (v[i] + v[i+1]) / 2) / (t[-1] - t[0])``.
        """
        return float(np.trapezoid(self.values, self.steps) / (self.steps[-1] - self.steps[0]))

    def steps_to(self, level: float) -> float:
        """The steps after which the curve is on the whole as high as a level, see `first_crossing`; else infinity."""
        return first_crossing(self.steps, self.values, level)


def shared_steps(curves: Sequence[Curve]) -> NDArray[np.float64]:
    """[Q] all steps at which one of the curves was evaluated, from where all have begun to where the first ends."""
    start, end = max(curve.steps[0] for curve in curves), min(curve.steps[-1] for curve in curves)
    steps = np.unique(np.concatenate([curve.steps for curve in curves]))
    return steps[(start <= steps) & (steps <= end)]


def mean_curve(curves: Sequence[Curve]) -> Curve:
    """The mean of some curves, over the steps that all of them have."""
    steps = shared_steps(curves)
    return Curve(steps, np.mean([curve.at(steps) for curve in curves], axis=0))
