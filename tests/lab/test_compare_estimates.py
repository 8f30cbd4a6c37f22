"""Estimates over few runs against numbers worked by hand, exact enumeration, scipy and simulation."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from hierroom.lab.compare.curve import Curve, mean_curve, shared_steps
from hierroom.lab.compare.estimates import estimate, interquartile_mean, mean, probability_of_improvement


def stratum(*runs):
    return np.array(runs, float)[:, None, None]


@pytest.mark.parametrize(
    ("scores", "expected"),
    [
        ([7], 7),
        ([0, 1, 5], 2),  # a quarter of three is less than one: nothing is dropped
        ([9, 1, 2, 100], 5.5),
        ([0, 1, 2, 3, 100], 2),
        ([8, 1, 7, 2, 6, 3, 5, 4], 4.5),
    ],
)
def test_interquartile_mean_by_hand(scores, expected):
    assert interquartile_mean([stratum(*scores)]) == pytest.approx([expected])


def test_scores_of_all_strata_are_pooled():
    assert interquartile_mean([stratum(1, 100), stratum(2, 0)]) == pytest.approx([1.5])
    assert mean([stratum(1, 100), stratum(2, 0)]) == pytest.approx([103 / 4])
    several = np.array([[[1.0], [100.0]], [[2.0], [0.0]]])  # two runs on two graphs
    assert interquartile_mean([several]) == pytest.approx([1.5])


def test_probability_of_improvement_by_hand():
    ours, theirs = np.array([[1.0], [3.0]]), np.array([[2.0], [3.0]])
    # 1 is below 2 and 3; 3 is above 2 and as good as 3
    assert probability_of_improvement([ours], [theirs]) == pytest.approx([1.5 / 4])
    assert probability_of_improvement([ours, theirs + 9], [theirs, ours]) == pytest.approx([(1.5 / 4 + 1) / 2])


SCORES = st.integers(1, 6).flatmap(lambda n: arrays(float, (n, 1), elements=st.integers(0, 4)))


@given(SCORES, SCORES)
def test_probability_of_improvement_equals_mann_whitney_statistic(ours, theirs):
    found = probability_of_improvement([ours], [theirs])[0]
    assert found == pytest.approx(stats.mannwhitneyu(ours[:, 0], theirs[:, 0]).statistic / (len(ours) * len(theirs)))
    assert found + probability_of_improvement([theirs], [ours])[0] == pytest.approx(1)


def test_interval_equals_quantiles_of_all_resamples():
    runs = np.array([0.1, 0.2, 0.4, 0.8])
    exact = np.sort([np.mean(sample) for sample in product(runs, repeat=4)])
    found = estimate([stratum(*runs)], mean, resamples=20_000, seed=0)
    assert found.values == pytest.approx([0.375])
    assert found.lows == pytest.approx([exact[round(0.025 * 256)]], abs=0.02)
    assert found.highs == pytest.approx([exact[round(0.975 * 256) - 1]], abs=0.02)


def test_runs_are_resampled_within_their_stratum():
    found = estimate([stratum(0, 0, 0), stratum(1, 1, 1)], mean, resamples=200, seed=0)
    assert (found.lows, found.values, found.highs) == ([0.5], [0.5], [0.5])


def test_run_on_many_graphs_is_resampled_as_one():
    once = np.random.default_rng(1).random((5, 1, 2))
    copied = np.repeat(once, 8, axis=1)
    one, many = (estimate([scores], mean, resamples=500, seed=3) for scores in (once, copied))
    np.testing.assert_allclose([many.values, many.lows, many.highs], [one.values, one.lows, one.highs])
    apart = estimate([once] * 8, mean, resamples=500, seed=3)  # as if they were eight times as many runs
    assert (apart.highs - apart.lows < 0.6 * (one.highs - one.lows)).all()


def test_seed_fixes_the_interval_regardless_of_batches(monkeypatch):
    strata = [np.random.default_rng(2).random((4, 1, 3))]
    first, again, other = (estimate(strata, mean, resamples=300, seed=seed) for seed in (0, 0, 1))
    np.testing.assert_array_equal(first.lows, again.lows)
    assert (first.lows != other.lows).any()
    monkeypatch.setattr("hierroom.lab.compare.estimates._ENTRIES_AT_ONCE", 50)
    batched = estimate(strata, mean, resamples=3000, seed=0)
    np.testing.assert_allclose(batched.lows, first.lows, atol=0.05)


def test_one_run_has_no_interval():
    found = estimate([stratum(1, 2, 3), stratum(5)], mean, resamples=200, seed=0)
    assert found.values == pytest.approx([11 / 4])
    assert np.isnan([found.lows, found.highs]).all()


def test_missing_values_are_not_estimated():
    scores = np.array([[[1.0, np.nan, 3.0]], [[2.0, 5.0, 4.0]]])
    found = estimate([scores], mean, resamples=200, seed=0)
    np.testing.assert_array_equal(np.isnan(found.values), [False, True, False])
    np.testing.assert_array_equal(np.isnan(found.lows), [False, True, False])
    assert found.values[[0, 2]] == pytest.approx([1.5, 3.5])


@pytest.mark.parametrize("statistic", [pytest.param(interquartile_mean, marks=pytest.mark.slow), mean])
def test_intervals_cover_the_true_value(statistic):
    """Ten runs on each of three graphs: the true value is in nearly 95% of the intervals.

    A bootstrap takes the variance with 10 in place of 9 below, so of the mean, with 27 degrees of freedom, it covers
    ``P(|t| < 1.96 sqrt(9 / 10))``, 92.6%; here within three standard errors of 400 experiments.
    """
    rng = np.random.default_rng(0)
    found = [estimate([*rng.normal(size=(3, 10, 1, 1))], statistic, resamples=600, seed=n) for n in range(400)]
    covered = np.mean([one.lows[0] <= 0 <= one.highs[0] for one in found])
    assert covered == pytest.approx(0.926, abs=0.04)


def curve(steps, values):
    return Curve(np.array(steps, float), np.array(values, float))


def test_curve_area_by_hand():
    assert curve([0, 10], [0, 1]).area == pytest.approx(0.5)
    # two trapezoids: 10 x 0.25 and 30 x 0.75, over 40 steps
    assert curve([0, 10, 40], [0, 0.5, 1]).area == pytest.approx(25 / 40)
    assert curve([5, 10], [3, 3]).area == 3


def test_curve_between_two_steps_by_hand():
    part = curve([0, 10, 40], [0, 0.5, 1]).between(5, 25)
    assert part.steps.tolist() == [5, 10, 25]
    assert part.values == pytest.approx([0.25, 0.5, 0.75])
    whole = curve([0, 10, 40], [0, 0.5, 1]).between(0, 40)
    assert whole.steps.tolist() == [0, 10, 40]


def test_steps_to_a_level_by_hand():
    rising = curve([0, 10, 40], [0, 0.5, 1])
    assert rising.steps_to(0) == 0
    assert rising.steps_to(0.25) == pytest.approx(5)
    assert rising.steps_to(0.5) == 10
    assert rising.steps_to(0.9) == pytest.approx(34)
    assert rising.steps_to(1.01) == np.inf
    assert curve([0, 10, 20, 30], [0, 1, 0, 1]).steps_to(0.4) == pytest.approx(8)  # it rises by 0, .5, .5, 1
    assert curve([0, 10, 20], [np.nan, 0.7, 1]).steps_to(0.5) == 10


def test_mean_curve_interpolates_curves_with_different_points():
    one, other = curve([0, 10, 40], [0, 0.5, 1]), curve([2, 10, 30], [1, 1, 1])
    assert shared_steps([one, other]).tolist() == [2, 10, 30]
    average = mean_curve([one, other])
    assert average.steps.tolist() == [2, 10, 30]
    assert average.values == pytest.approx([0.55, 0.75, (0.5 + 20 / 30 * 0.5 + 1) / 2])


def test_curve_without_first_value_has_no_area():
    late = curve([0, 10, 20], [np.nan, 3, 1])
    np.testing.assert_array_equal(late.at(np.array([0.0, 5, 10, 15, 20])), [np.nan, np.nan, 3, 2, 1])
    assert np.isnan(late.area)
    assert late.between(10, 20).area == 2
