"""The learning curve of a run: evaluations at planned steps, and the steps until a success rate is reached."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hierroom.agents.evaluation import Evaluation, geometric_mean

MILESTONES = (50, 90, 95, 99)
"""Success rates in percent; a run's summary has the steps until each is reached."""
FIRST_POINT = 0.01
"""The first evaluation after the one at step 0, as a share of all steps; it is early, as learning is fast then."""


def evaluation_points(steps: int, evaluations: int) -> list[int]:
    """Return the steps at which to evaluate: 0, and ``evaluations`` more at equal ratios to the last; none for 0."""
    if evaluations == 0:
        return []
    points = np.geomspace(max(1.0, FIRST_POINT * steps), steps, evaluations) if evaluations > 1 else [steps]
    return [0, *sorted({min(steps, round(float(point))) for point in points})]


def evaluation_rows(steps: int, seconds: float, evaluation: Evaluation) -> list[dict[str, object]]:
    """Return rows of ``evaluations.csv``, one per goal graph, with how often and when each goal was first achieved."""
    rows = []
    for graph, score in evaluation.graphs.items():
        numbers = {**score.columns, **score.goal_columns}
        row = {"steps": steps, "seconds": round(seconds, 3), "graph": graph, "episodes": score.episodes}
        rows.append(row | {name: round(value, 6) for name, value in numbers.items()})
    return rows


@dataclass(frozen=True)
class Crossing:
    """The step at which a success rate was reached."""

    steps: float  # primitive steps trained until then
    seconds: float  # of training until then
    low: float  # lower end of the 95% interval of ``steps``
    high: float  # upper end; infinity if it is possible that the rate was never reached


@dataclass(frozen=True)
class LearningCurve:
    """Success at the P evaluations of a run, over all goal graphs together; else the score or the return counts."""

    steps: np.ndarray  # [P] primitive steps trained until then, increasing
    seconds: np.ndarray  # [P] seconds of training until then
    success: np.ndarray  # [P] success rates; NaN without a target
    returns: np.ndarray  # [P] mean returns
    length: np.ndarray  # [P] mean lengths of the episodes in primitive steps
    episodes: np.ndarray  # [P] numbers of episodes
    outcome_name: str  # what counts: ``success_rate``, ``score`` or ``return``, see `GoalSet.outcome`
    shares: np.ndarray  # [P, K] of episodes: that succeeded, K = 1; for the score, that achieved each of K goals

    @classmethod
    def of_rows(cls, rows: Sequence[Mapping[str, str]]) -> LearningCurve | None:
        """Return the curve of rows of ``evaluations.csv``, weighting each graph by its episodes; None without rows."""
        if not rows:
            return None
        table = {name: np.array([float(row[name]) for row in rows]) for name in ("steps", "seconds", "episodes")}
        steps, first, point = np.unique(table["steps"], return_index=True, return_inverse=True)
        weights = table["episodes"]
        episodes = np.bincount(point, weights, len(steps))

        def mean(name: str) -> np.ndarray:
            values = np.array([float(row[name]) for row in rows])
            return np.bincount(point, weights * values, len(steps)) / episodes

        success, has_score = mean("success_rate"), "score" in rows[0]
        name = "score" if has_score else "return" if np.isnan(success).all() else "success_rate"
        goals = [mean(name) for name in rows[0] if name.startswith("achieved_")] if has_score else [success]
        numbers = success, mean("return"), mean("length"), episodes, name, np.stack(goals, axis=1)
        return cls(steps, table["seconds"][first], *numbers)

    @property
    def area(self) -> float:
        """The mean outcome over the steps: the area under the curve divided by its number of steps."""
        return float(np.trapezoid(self.outcome, self.steps) / np.ptp(self.steps)) if len(self.steps) > 1 else np.nan

    @property
    def is_rate(self) -> bool:
        """Return whether success or the score counts, which are from 0 to 1."""
        return self.outcome_name != "return"

    @property
    def outcome(self) -> np.ndarray:
        """Return the values [P] of the outcome that counts."""
        return self._rate(self.shares) if self.is_rate else self.returns

    @property
    def last(self) -> tuple[float, float, float]:
        """Success rate, return and score of the last evaluation, NaN if there is none."""
        return self.success[-1], self.returns[-1], self.outcome[-1] if self.outcome_name == "score" else np.nan

    def _rate(self, shares: np.ndarray) -> np.ndarray:
        return geometric_mean(shares) if self.outcome_name == "score" else shares[..., 0]

    def crossing(self, percent: float, resamples: int = 1000) -> Crossing | None:
        """Return when the success rate or score reached a percentage, see `first_crossing`; None if it did not.

        The interval covers only the chance in the evaluations' episodes. Each share is drawn from its posterior
        Beta(successes + 1/2, failures + 1/2) (Jeffreys), and the crossing of each drawn curve is found. The draws are
        the same in every call.
        """
        level = percent / 100
        rates = self._rate(self.shares)
        steps, seconds = (first_crossing(x, rates, level) for x in (self.steps, self.seconds))
        if np.isinf(steps):
            return None
        episodes = self.episodes[:, None]
        successes = self.shares * episodes
        drawn = np.random.default_rng(0).beta(
            successes + 0.5, episodes - successes + 0.5, (resamples, *self.shares.shape)
        )
        crossings = [first_crossing(self.steps, one, level) for one in self._rate(drawn)]
        low, high = np.quantile(crossings, (0.025, 0.975), method="inverted_cdf")  # works with infinities
        return Crossing(steps, seconds, float(min(low, steps)), float(max(high, steps)))


def first_crossing(x: np.ndarray, values: np.ndarray, level: float) -> float:
    """Return the x where values reach a level, by linear interpolation; infinity if they never do.

    A measured value that is high by chance must not count. So isotonic regression first replaces the values by the
    non-decreasing ones that are nearest by least squares; these reach a level only if the values stay high on the
    whole. Both are [P]; x increases, and values may be NaN.
    """
    from scipy.optimize import isotonic_regression  # it loads slowly, and only the end of a run needs it

    known = ~np.isnan(values)
    if not known.any():
        return np.inf
    x, rising = x[known], isotonic_regression(values[known]).x
    reached = np.flatnonzero(rising >= level - 1e-12)
    if not len(reached):
        return np.inf
    after = reached[0]
    if after == 0:
        return float(x[0])
    (low, high), (start, end) = rising[after - 1 : after + 1], x[after - 1 : after + 1]
    return float(start + (level - low) / (high - low) * (end - start))
