"""Fits of log T = a + b log m + s e to runs of which some are censored, and how well they predict others."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_ndtr
from scipy.stats import spearmanr

from benchmarks.prediction.rows import Runs, task_medians

MIN_SIGMA = 0.05
COVERED = 0.9


class Line(NamedTuple):
    """A fitted model: see `hierroom.lab.advise.model`."""

    intercept: float
    slope: float
    sigma: float

    def of(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the predicted median of log T for log measures."""
        return self.intercept + self.slope * x


class Score(NamedTuple):
    """Hold how well predictions of unseen tasks fit: see `python -m benchmarks.prediction`.

    ``never_right`` is the share of the runs that did not get there which were predicted so; the last three count tasks:
    where the median run did not get there, where this was predicted, and where it was predicted wrongly.
    """

    tasks: int
    rank: float
    concordance: float
    factor: float
    within_2: float
    coverage: float
    never_right: float
    never: int
    never_found: int
    never_wrong: int


def fit(x: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]) -> Line:
    """Return the line of the greatest likelihood (log-normal accelerated failure time; Tobit, 1958).

    An exact time adds its density, one that is only known to be later or earlier than a step its probability.
    """
    is_late, is_early = np.isinf(high), np.isinf(low)
    is_exact = ~is_late & ~is_early
    centre = x.mean()

    def loss(parameters: NDArray[np.float64]) -> float:
        a, b, log_sigma = parameters
        sigma = MIN_SIGMA + np.exp(log_sigma)
        middle = a + b * (x - centre)
        exact = ((low - middle) / sigma)[is_exact]
        total = (-0.5 * exact**2 - np.log(sigma)).sum()
        total += log_ndtr((middle - low)[is_late] / sigma).sum() + log_ndtr((high - middle)[is_early] / sigma).sum()
        return -float(total)

    start = np.where(is_early, high, low)
    found = minimize(
        loss, [np.median(start), 0.8, -0.5], method="Nelder-Mead", options={"maxiter": 2000, "xatol": 1e-5}
    )
    a, b, log_sigma = found.x
    return Line(float(a - b * centre), float(b), float(MIN_SIGMA + np.exp(log_sigma)))


def factors(runs: Runs, predicted: NDArray[np.float64]) -> tuple[float, float]:
    """Return the factors of the predicted steps that 5% of held-out runs are below, and 5% above.

    A task counts once, however many runs it has, and one more task of which nothing is known counts on both sides
    (split conformal prediction). A run that never got there is above; before the predicted step it says nothing.
    """
    late, early = np.isinf(runs.high), np.isinf(runs.low)
    error = np.where(early, runs.high, runs.low) - predicted
    error[late] = np.where(predicted[late] < runs.low[late], np.inf, np.nan)
    kept = ~np.isnan(error)
    tasks, inverse = np.unique(runs.tasks[kept], return_inverse=True)
    weight = 1 / np.bincount(inverse, minlength=len(tasks))[inverse]
    tail = (1 - COVERED) / 2 * (weight.sum() + 1)

    def end(signed: NDArray[np.float64]) -> float:
        order = np.argsort(signed)
        at = np.searchsorted(np.cumsum(weight[order]), weight.sum() - max(tail - 1, 0.0) - 1e-9)
        return float(np.exp(signed[order][min(at, len(order) - 1)]))

    return 1 / end(-error[kept]), end(error[kept])


def score(runs: Runs, predicted: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]) -> Score:
    """Return how well predictions [R] of log T, with intervals from ``low`` to ``high`` [R], fit the runs."""
    _, middle, times = task_medians(runs, predicted)
    reached = np.isfinite(times)
    error = np.abs(middle[reached] - times[reached])
    capped = np.minimum(times, times[reached].max(initial=0.0) + 1)
    late, early = np.isinf(runs.high), np.isinf(runs.low)
    inside = (np.where(early, runs.high, runs.low) <= high) & (late | (np.where(early, runs.high, runs.low) >= low))
    rank = spearmanr(middle, capped).statistic if len(middle) > 2 else np.nan
    never = late & (runs.low > 0)
    right = (predicted[never] >= runs.low[never]).mean() if never.any() else np.nan
    is_said = middle >= runs.low[never].min(initial=np.inf)
    return Score(
        len(middle),
        float(rank),  # pyright: ignore[reportArgumentType] - the stub has a tuple only
        concordance(runs, predicted),
        float(np.exp(np.median(error))) if len(error) else np.nan,
        float((error <= np.log(2)).mean()) if len(error) else np.nan,
        float(inside.mean()),
        float(right),
        int((~reached).sum()),
        int((is_said & ~reached).sum()),
        int((is_said & reached).sum()),
    )


def concordance(runs: Runs, predicted: NDArray[np.float64]) -> float:
    """Return Harrell's C: among pairs of runs whose order is known, the share that are predicted in this order.

    Equal predictions count half (Harrell et al., 1982).
    """
    first = np.where(np.isinf(runs.low), runs.high, runs.low)
    is_known = np.isfinite(runs.high)
    earlier = (first[:, None] < first[None, :]) & is_known[:, None] & (runs.tasks[:, None] != runs.tasks[None, :])
    n = earlier.sum()
    right = (earlier & (predicted[:, None] < predicted[None, :])).sum()
    ties = (earlier & (predicted[:, None] == predicted[None, :])).sum()
    return float((right + ties / 2) / n) if n else np.nan
