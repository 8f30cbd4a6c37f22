"""Learning curves: when a run is evaluated, and when its success rate was first so high, by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hierroom.training.learning_curve import LearningCurve, evaluation_points


def row(steps, rate, *, graph="a", episodes=100, length=10.0):
    return {name: str(value) for name, value in locals().items() if name != "rate"} | {
        "success_rate": str(rate),
        "seconds": str(steps / 10),
    }


def test_points_are_before_training_and_then_at_equal_ratios():
    assert evaluation_points(10_000, 3) == [0, 100, 1000, 10_000]
    assert evaluation_points(10_000, 1) == [0, 10_000]
    assert evaluation_points(10_000, 0) == []


@given(st.integers(1, 10**9), st.integers(1, 60))
def test_points_increase_and_end_with_the_run(steps, evaluations):
    points = evaluation_points(steps, evaluations)
    assert points == sorted(set(points))
    assert (points[0], points[-1]) == (0, steps)
    assert len(points) <= evaluations + 1


def test_a_crossing_is_interpolated_between_the_evaluations_around_it():
    curve = LearningCurve.of_rows([row(0, 0.0), row(100, 0.4), row(300, 0.9), row(900, 0.8), row(1000, 1.0)])
    assert curve.first_crossing(20) == pytest.approx((50, 5))
    assert curve.first_crossing(40) == pytest.approx((100, 10))
    assert curve.first_crossing(65) == pytest.approx((200, 20))
    assert curve.first_crossing(90) == pytest.approx((300, 30))
    assert curve.first_crossing(95) == pytest.approx((975, 97.5))
    assert LearningCurve.of_rows([row(0, 0.0), row(100, 0.4)]).first_crossing(50) is None
    assert LearningCurve.of_rows([row(0, 0.7), row(100, 0.4)]).first_crossing(50) == (0, 0)


def test_several_graphs_count_by_their_episodes():
    rows = [row(0, 0.0, graph="a"), row(0, 0.0, graph="b", episodes=300)]
    rows += [row(64, 1.0, graph="a"), row(64, 0.2, graph="b", episodes=300, length=30)]
    curve = LearningCurve.of_rows(rows)
    np.testing.assert_allclose(curve.success, [0, (100 + 60) / 400])
    np.testing.assert_allclose(curve.length, [10, (1000 + 9000) / 400])
    assert curve.steps.tolist() == [0, 64]
