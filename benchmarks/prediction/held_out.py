"""Predictions of what a fit has not seen: other worlds, or other tasks of a world."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.prediction.fit import Line, factors, fit, fit_worlds
from benchmarks.prediction.rows import Runs
from hierroom.lab.advise import model

FOLDS, SEED = 10, 0
MANY_WORLDS, LEAST_FACTOR = 6, 4.0
"""With fewer worlds than that, the least factor of intervals in worlds that have no runs."""


def across(runs: Runs, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return predictions [R] of each world's runs by a fit to all other worlds, and their half intervals."""
    return _held_out(runs, x, runs.worlds, fit_worlds)


def within(runs: Runs, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return predictions [R] of each task's runs by a fit to other tasks of its world, and their half intervals."""
    predicted, half = np.full((2, len(runs)), np.nan)
    for world in np.unique(runs.worlds):
        of_world = runs.worlds == world
        tasks = np.unique(runs.tasks[of_world])
        folds = dict(zip(tasks, np.random.default_rng(SEED).permutation(len(tasks)) % FOLDS, strict=True))
        fold = np.array([folds[task] for task in runs.tasks[of_world]])
        predicted[of_world], half[of_world] = _held_out(runs.where(of_world), x[of_world], fold, fit)
    return predicted, half


def _held_out(runs: Runs, x: NDArray, parts: NDArray[Any], fit_to: Callable[..., Line]) -> tuple[NDArray, NDArray]:
    predicted, half = np.full((2, len(runs)), np.nan)
    for part in np.unique(parts):
        held = parts == part
        if not held.all():
            line = fit_to(runs.where(~held), x[~held])
            predicted[held], half[held] = line.of(x[held]), model.Z90 * line.sigma
    return predicted, half


def in_one_world(runs: Runs, x: NDArray[np.float64]) -> tuple[float, ...]:
    """Return the line of a world from its own runs, and the factors of its 90% interval."""
    return *fit(runs, x), *factors(runs, within(runs, x)[0])


def in_other_worlds(runs: Runs, x: NDArray[np.float64]) -> tuple[float, ...]:
    """Return the line of a world that has no runs, and the factors of its 90% interval, from two worlds or more."""
    low, high = factors(runs, across(runs, x)[0], runs.worlds)
    if len(np.unique(runs.worlds)) < MANY_WORLDS:
        low, high = min(low, 1 / LEAST_FACTOR), max(high, LEAST_FACTOR)
    return *fit_worlds(runs, x), low, high
