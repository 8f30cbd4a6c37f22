"""Fits of log T = a + b log m + s e to runs of which some are censored, and how well they predict others.

In a fit to several worlds each has an intercept of its own, normal around a: the world is a random effect.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_ndtr
from scipy.stats import spearmanr

from benchmarks.prediction.rows import Runs, task_medians

MIN_SIGMA = 0.05
COVERED = 0.9
MOST_ROUNDS = 100


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


def fit(runs: Runs, x: NDArray[np.float64]) -> Line:
    """Return the line of the greatest likelihood of one world's runs (Tobit, 1958).

    Args:
        runs: R runs.
        x: [R] log measures of their tasks.
    """
    centre, times = x.mean(), np.where(np.isinf(runs.low), runs.high, runs.low)

    def loss(parameters: NDArray[np.float64]) -> float:
        a, b, log_sigma = parameters
        return -float(_log_likelihood(runs, a + b * (x - centre), MIN_SIGMA + np.exp(log_sigma)).sum())

    options = {"maxiter": 2000, "xatol": 1e-5}
    a, b, log_sigma = minimize(loss, [np.median(times), 0.8, -0.5], method="Nelder-Mead", options=options).x
    return Line(float(a - b * centre), float(b), float(MIN_SIGMA + np.exp(log_sigma)))


def fit_worlds(runs: Runs, x: NDArray[np.float64]) -> Line:
    """Return the line of a world that has no runs, from runs in others, with the spread of its tasks and of worlds.

    Worlds share slope and spread s; their intercepts are normal with deviation t. The intercepts are those of the
    greatest posterior density, t is estimated by EM with Laplace's approximation, and the spread of a new world among W
    is ``sqrt(s^2 + t^2 (1 + 1/W))``. Each task counts once, however many runs it has.

    Args:
        runs: R runs.
        x: [R] log measures of their tasks.
    """
    names, world = np.unique(runs.worlds, return_inverse=True)
    if len(names) == 1:
        return fit(runs, x)
    weight, centre = 1 / _size(runs.tasks), x.mean()
    times = np.where(np.isinf(runs.low), runs.high, runs.low)

    def loss(parameters: NDArray[np.float64], between: float) -> float:
        intercepts, (b, log_sigma) = parameters[:-2], parameters[-2:]
        middle, sigma = intercepts[world] + b * (x - centre), MIN_SIGMA + np.exp(log_sigma)
        prior = ((intercepts - intercepts.mean()) ** 2).sum() / (2 * between**2)
        return float(prior - (weight * _log_likelihood(runs, middle, sigma)).sum())

    best, between = np.array([*[np.median(times)] * len(names), 0.8, -0.5]), 1.0
    for _ in range(MOST_ROUNDS):
        best = minimize(loss, best, (between,), method="BFGS").x
        intercepts, sigma = best[:-2], MIN_SIGMA + np.exp(best[-1])
        step = np.array([[-1.0], [0.0], [1.0]]) * 1e-3
        around = _log_likelihood(runs, intercepts[world] + best[-2] * (x - centre) + step, sigma)
        curvature = -np.bincount(world, weight * np.diff(around, 2, axis=0)[0]) / 1e-6
        square = ((intercepts - intercepts.mean()) ** 2 + 1 / (curvature + between**-2)).sum() / (len(names) - 1)
        previous, between = between, float(np.sqrt(square))
        if abs(between - previous) < 1e-3:
            break
    spread = np.sqrt(sigma**2 + between**2 * (1 + 1 / len(names)))
    return Line(float(intercepts.mean() - best[-2] * centre), float(best[-2]), float(spread))


def _log_likelihood(runs: Runs, middle: NDArray[np.float64], sigma: float) -> NDArray[np.float64]:
    """Return that of each run, whose log times are normal around ``middle`` [..., R].

    An exact time has its density, one that is only known to be later or earlier than a step its probability.
    """
    late, early = np.isinf(runs.high), np.isinf(runs.low)
    z = (np.where(early, runs.high, runs.low) - middle) / sigma
    return np.where(late | early, log_ndtr(np.where(late, -z, z)), -0.5 * z**2 - np.log(sigma))


def factors(runs: Runs, predicted: NDArray[np.float64], groups: NDArray[Any] | None = None) -> tuple[float, float]:
    """Return the factors of the predicted steps that 5% of held-out runs are below, and 5% above.

    A task counts once, however many runs it has, and one more task of which nothing is known counts on both sides
    (split conformal prediction). A run that never got there is above; before the predicted step it says nothing.

    Args:
        runs: R runs.
        predicted: [R] logs of steps, by fits that have not seen the tasks.
        groups: [R] what counts as much as each other one, such as the worlds.
    """
    late, early = np.isinf(runs.high), np.isinf(runs.low)
    error = np.where(early, runs.high, runs.low) - predicted
    error[late] = np.where(predicted[late] < runs.low[late], np.inf, np.nan)
    kept = ~np.isnan(error)
    weight = 1 / _size(runs.tasks[kept])
    n_tasks = weight.sum()
    if groups is not None:
        weight /= np.array([weight[groups[kept] == one].sum() for one in groups[kept]])
        weight *= n_tasks / weight.sum()
    tail = (1 - COVERED) / 2 * (n_tasks + 1)

    def end(signed: NDArray[np.float64]) -> float:
        order = np.argsort(signed)
        at = np.searchsorted(np.cumsum(weight[order]), n_tasks - max(tail - 1, 0.0) - 1e-9)
        return float(np.exp(signed[order][min(at, len(order) - 1)]))

    return 1 / end(-error[kept]), end(error[kept])


def _size(names: NDArray[Any]) -> NDArray[np.int64]:
    """Return for each name how often it is there."""
    _, inverse = np.unique(names, return_inverse=True)
    return np.bincount(inverse)[inverse]


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
