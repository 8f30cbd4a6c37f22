"""The study's statistics, on tables with known answers."""

import numpy as np
import pytest

from benchmarks.study.correlations import correlations, interval
from benchmarks.study.random_work import random_steps
from benchmarks.study.trained import medians
from hierroom import Rules, workshop


def test_medians_take_never_reached_as_infinite():
    inf, nan = np.inf, np.nan
    outcomes = np.array([[3, 1, 9], [5, 7, nan], [1, inf, nan], [1, 2, inf], [inf, inf, 4], [8, nan, nan]])
    assert medians(outcomes).tolist() == [3, 6, inf, 2, inf, 8]


def test_correlations_by_hand():
    """Ranks 1 2 3 5 4: rho = 1 - 6 * 2 / (5 * 24) = 0.9, tau = (9 - 1) / 10; goals 1 1 2 2 2: rho = 9 / sqrt(120)."""
    goals = np.array([3.0, 3, 5, 5, 5])
    table = correlations(np.array([10.0, 20, 30, 40, 50]), {"x": np.array([1.0, 2, 3, 9, 4]), "goals": goals}, goals)
    count = 0.8660254
    assert table["x", "spearman"] == pytest.approx(0.9)
    assert table["x", "kendall"] == pytest.approx(0.8)
    assert table["goals", "spearman"] == pytest.approx(count)
    assert table["x", "minus goals"] == pytest.approx(0.9 - count)
    assert table["x", "given goals"] == pytest.approx((0.9 - count**2) / (1 - count**2))
    assert table["goals", "minus goals"] == 0
    assert np.isnan(table["x", "minus hitting time"])
    assert np.isnan(table["goals", "given goals"])
    assert np.isnan(table["x", "at fixed goals"])  # no four graphs have as many


def test_never_reached_ranks_last_and_tied():
    """Ranks 1 2 3.5 3.5 against 1 2 3 4: rho = 4.5 / sqrt(4.5 * 5), tau-b = 5 / sqrt(5 * 6)."""
    table = correlations(np.array([5.0, 6, np.inf, np.inf]), {"x": np.array([1.0, 2, 3, 4])}, np.array([3.0, 3, 5, 5]))
    assert table["x", "spearman"] == pytest.approx(4.5 / np.sqrt(4.5 * 5))
    assert table["x", "kendall"] == pytest.approx(5 / np.sqrt(30))


def test_interval_is_corrected_for_bootstrap_bias():
    """The resamples 0.50, 0.51, ... 0.70 have a mean of 0.60, and their 5% and 95% points are 0.51 and 0.69."""
    resamples = np.linspace(0.5, 0.7, 21)
    assert interval(0.6, resamples, 0.9) == pytest.approx((0.6, 0.51, 0.69))
    assert interval(0.8, resamples, 0.9) == pytest.approx((0.8, 0.71, 0.89))
    assert interval(0.95, resamples, 0.9) == pytest.approx((0.95, 0.86, 1))
    assert interval(0.95, resamples, 0.9, bound=2) == pytest.approx((0.95, 0.86, 1.04))
    assert str(interval(-0.001, resamples - 0.601, 0.9)) == "0.00 [-0.09, 0.09]"
    few = np.where(np.arange(21) < 3, np.nan, resamples)
    assert str(interval(0.6, few, 0.9)) == "0.60"
    assert str(interval(np.nan, resamples, 0.9)) == "-"


def test_random_steps_of_one_recipe_by_hand():
    # Three actions: put the source, work, clear. From an empty bench the source is put in 3 steps on average; then
    # work ends it, clear begins again and a second put changes nothing: m = 3 + n, n = 1 + n / 3 + m / 3, so m = 9.
    recipes = workshop(Rules({"wood": {"gives": "wood"}}, target="wood")).book.recipes
    assert random_steps(recipes) == pytest.approx(9)
