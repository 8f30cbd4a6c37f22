"""Learning curves by hand: evaluation points, and the steps at which a success rate is crossed."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hierroom.runs.logs.learning_curve import LearningCurve, evaluation_points
from hierroom.support.intervals import wilson_interval


def row(steps, rate, *, graph="a", episodes=100, length=10.0):
    return {name: str(value) for name, value in locals().items() if name != "rate"} | {
        "success_rate": str(rate),
        "seconds": str(steps / 10),
        "return": "0",
    }


def test_evaluation_points_are_zero_and_then_geometric():
    assert evaluation_points(10_000, 3) == [0, 100, 1000, 10_000]
    assert evaluation_points(10_000, 1) == [0, 10_000]
    assert evaluation_points(10_000, 0) == []


@given(st.integers(1, 10**9), st.integers(1, 60))
def test_evaluation_points_increase_and_end_with_the_run(steps, evaluations):
    points = evaluation_points(steps, evaluations)
    assert points == sorted(set(points))
    assert (points[0], points[-1]) == (0, steps)
    assert len(points) <= evaluations + 1


def test_crossing_is_interpolated_between_two_evaluations():
    curve = LearningCurve.of_rows([row(0, 0.0), row(100, 0.4), row(300, 0.9), row(900, 0.9), row(1000, 1.0)])
    for percent, steps in ((20, 50), (40, 100), (65, 200), (90, 300), (95, 950)):
        crossing = curve.crossing(percent)
        assert (crossing.steps, crossing.seconds) == pytest.approx((steps, steps / 10))
    assert LearningCurve.of_rows([row(0, 0.0), row(100, 0.4)]).crossing(50) is None


def test_single_high_evaluation_is_no_crossing():
    rates = [0.0, 0.2, 0.6, 0.2, 0.2, 0.6, 0.8]
    curve = LearningCurve.of_rows([row(100 * n, rate) for n, rate in enumerate(rates)])
    # The nearest rising curve is 0, .2, 1/3, 1/3, 1/3, .6, .8: 0.5 is at 5/8 of the way from 400 to 500.
    assert curve.crossing(50).steps == pytest.approx(400 + 100 * (0.5 - 1 / 3) / (0.6 - 1 / 3))
    assert LearningCurve.of_rows([row(0, 0.7), row(100, 0.2)]).crossing(50) is None, "it was lost again"


@pytest.mark.parametrize("episodes", [50, 200])
def test_crossing_interval_covers_the_true_crossing(episodes):
    generator, steps = np.random.default_rng(episodes), np.geomspace(1000, 100_000, 30)
    true = np.log(steps / 1000) / np.log(100)  # it is 0.5 after 10,000 steps
    held, widths = 0, []
    for _ in range(100):
        rates = generator.binomial(episodes, true) / episodes
        curve = LearningCurve.of_rows([row(s, r, episodes=episodes) for s, r in zip(steps, rates, strict=True)])
        crossing = curve.crossing(50, resamples=200)
        held += crossing.low <= 10_000 <= crossing.high
        widths.append(crossing.high - crossing.low)
    assert held >= 88
    assert max(widths) < 15_000


def test_interval_is_infinite_if_rate_may_be_unreached():
    curve = LearningCurve.of_rows([row(0, 0.0), row(100, 0.3), row(200, 0.96, episodes=100)])
    crossing = curve.crossing(95)
    assert 100 < crossing.low <= crossing.steps < 200
    assert crossing.high == np.inf


def test_area_is_the_mean_success_over_steps():
    assert LearningCurve.of_rows([row(0, 0.0), row(100, 1.0), row(400, 1.0)]).area == pytest.approx(0.875)


def test_curve_weights_graphs_by_their_episodes():
    rows = [row(0, 0.0, graph="a"), row(0, 0.0, graph="b", episodes=300)]
    rows += [row(64, 1.0, graph="a"), row(64, 0.2, graph="b", episodes=300, length=30)]
    curve = LearningCurve.of_rows(rows)
    np.testing.assert_allclose(curve.success, [0, (100 + 60) / 400])
    np.testing.assert_allclose(curve.length, [10, (1000 + 9000) / 400])
    assert curve.steps.tolist() == [0, 64]


def test_wilson_interval_by_hand():
    # 10 of 50 in the tables of Brown, Cai and DasGupta's formula, worked out by hand: z = 1.96, z^2 = 3.8415
    value, low, high = wilson_interval(0.2, 50, 0.95)
    assert (value, round(low, 4), round(high, 4)) == (0.2, 0.1124, 0.3304)
    assert wilson_interval(0.0, 300, 0.95).high == pytest.approx(3.8415 / 303.8415, rel=1e-4)
    assert wilson_interval(1.0, 300, 0.95).low == pytest.approx(300 / 303.8415, rel=1e-4)
