"""Reach curves: closed forms, both ways to compute them, a million steps."""

import numpy as np
import pytest
import scipy.sparse as sp

from hierroom.complexity import AugmentedGraph, analyze, expected_states, hitting_probability, reach_probability
from hierroom.complexity.chains import reach as reach_module
from hierroom.goals import NAMED_GRAPHS, GoalGraph
from hierroom.support.errors import InputError

TIMES = np.array([0, 1, 2, 3, 10, 100, 999, 1000, 4097, 10**5, 10**6])


def complete(n):
    return (np.ones((n, n)) - np.eye(n)) / (n - 1)


@pytest.mark.parametrize("form", [np.asarray, sp.csr_array])
def test_reach_on_a_complete_graph(form):
    n = 5
    missed = (1 - 1 / (n - 1)) ** TIMES
    np.testing.assert_allclose(reach_probability(form(complete(n)), 0, 1, TIMES), 1 - missed, atol=1e-12)
    np.testing.assert_allclose(expected_states(form(complete(n)), 0, TIMES), 1 + (n - 1) * (1 - missed), rtol=1e-10)


@pytest.mark.parametrize("method", ["later_by_squaring", "later_by_stepping"])
def test_reach_equals_powers_of_the_matrix(monkeypatch, method):
    for name in ("later_by_squaring", "later_by_stepping"):
        monkeypatch.setattr(reach_module, name, getattr(reach_module, method))
    weights = AugmentedGraph(NAMED_GRAPHS["c"], drop_key=True).weights.toarray()
    chances = weights + np.diag(1 - weights.sum(axis=1))
    chances[-1] = np.eye(9)[-1]
    times = TIMES[:-2]
    expected = [np.linalg.matrix_power(chances, t)[0, -1] for t in times]
    np.testing.assert_allclose(reach_probability(weights, 0, 8, times), expected, atol=1e-11)
    shuffled = np.random.default_rng(0).permutation(len(times))
    again = reach_probability(weights, 0, 8, times[shuffled])
    np.testing.assert_allclose(again, np.take(expected, shuffled), atol=1e-11)


def test_reach_of_a_target_that_may_be_missed():
    w = np.zeros((4, 4))
    w[0, 1], w[0, 2] = 0.3, 0.1  # node 3 is alone
    expected = 0.75 * (1 - 0.6**TIMES)
    np.testing.assert_allclose(reach_probability(w, 0, 1, TIMES), expected, atol=1e-12)
    assert reach_probability(w, 0, 1, 10**6) == pytest.approx(hitting_probability(w, 1)[0])
    assert reach_probability(w, 0, 3, TIMES).tolist() == [0] * len(TIMES)
    assert reach_probability(w, 1, 1, TIMES).tolist() == [1] * len(TIMES)
    np.testing.assert_allclose(expected_states(w, 0, TIMES), 1 + (1 - 0.6**TIMES), atol=1e-12)


def test_reach_curve_sums_to_expected_steps():
    report = analyze(GoalGraph((0,) * 5, 1))
    curve = report.reach_probability(np.arange(2001))
    assert (np.diff(curve) >= -1e-15).all()
    # the mean is the sum of the chances to need longer
    later = 1 - report.reach_probability(np.arange(60_000))
    assert later.sum() == pytest.approx(report.expected_steps, rel=1e-8)
    assert report.reach_probability(10**6) == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize("letter", NAMED_GRAPHS)
def test_expected_states_after_one_and_many_steps(letter):
    report = analyze(letter)
    states = report.expected_states([0, 1, 10**6])
    np.testing.assert_allclose(states, [1, 1.19, report.nodes], atol=1e-9)


def test_results_keep_the_shape_of_times():
    report = analyze("b")
    assert report.reach_probability(5).shape == ()
    assert report.reach_probability([[1, 2, 3], [4, 5, 6]]).shape == (2, 3)
    assert report.expected_states([]).shape == (0,)


def test_expected_states_without_nodes_are_zero():
    assert expected_states(np.eye(3), 0, [0, 5], nodes=[]).tolist() == [0, 0]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("times", [-1, 0.5, [1, -2], np.nan, "soon", np.inf, 1e30, 2**63, True, [[1], [1, 2]]])
def test_invalid_times_raise_input_error(times):
    with pytest.raises(InputError, match="numbers of steps must be whole numbers from 0"):
        analyze("a").reach_probability(times)


def test_multiplicity_of_other_length_raises_input_error():
    with pytest.raises(InputError, match="multiplicity must have a number for each of 2 nodes"):
        expected_states(np.eye(3), 0, [0, 5], nodes=[0, 1], multiplicity=[1])
