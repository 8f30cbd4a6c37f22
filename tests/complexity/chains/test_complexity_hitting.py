"""First passage against closed forms: birth-death chains, complete graphs, gambler's ruin, series of waits."""

import numpy as np
import pytest
import scipy.sparse as sp

from hierroom.complexity import (
    AugmentedGraph,
    expected_visits,
    first_passage_variance,
    hitting_probability,
    mean_first_passage_time,
    passage_time_sensitivity,
)
from hierroom.goals import NAMED_GRAPHS
from hierroom.support.errors import InputError

FORMS = pytest.mark.parametrize("form", [np.asarray, sp.csr_array, sp.csc_matrix, sp.coo_array])


def birth_death(up, down):
    """Nodes 0..n; ``up[i]`` leads from i to i + 1, ``down[i]`` from i + 1 to i."""
    return np.diag(up, 1) + np.diag(down, -1)


def complete(n):
    return (np.ones((n, n)) - np.eye(n)) / (n - 1)


@FORMS
def test_mean_of_a_birth_death_chain(form):
    rng = np.random.default_rng(0)
    up, down = rng.uniform(0.1, 0.4, 6), rng.uniform(0.1, 0.4, 6)
    # m_{i -> i+1} = (1 + down_{i-1} m_{i-1 -> i}) / up_i, the recursion of every textbook
    climb = np.zeros(6)
    for i in range(6):
        climb[i] = (1 + (down[i - 1] * climb[i - 1] if i else 0)) / up[i]
    means = mean_first_passage_time(form(birth_death(up, down)), 6)
    np.testing.assert_allclose(means, np.append(climb[::-1].cumsum()[::-1], 0), rtol=1e-12)


@FORMS
def test_mean_and_variance_on_a_complete_graph(form):
    # the target is missed with chance 1 - 1 / (n - 1) each step: geometric
    n = 7
    chance = 1 / (n - 1)
    means = mean_first_passage_time(form(complete(n)), 2)
    variances = first_passage_variance(form(complete(n)), 2)
    expected = np.where(np.arange(n) == 2, 0, 1)
    np.testing.assert_allclose(means, expected / chance, rtol=1e-12)
    np.testing.assert_allclose(variances, expected * (1 - chance) / chance**2, rtol=1e-12)


def test_diagonal_of_weights_may_be_left_out():
    moves = birth_death([0.2, 0.3], [0.1, 0.4])
    written_out = moves + np.diag(1 - moves.sum(axis=1))
    np.testing.assert_allclose(mean_first_passage_time(moves, 2), mean_first_passage_time(written_out, 2), rtol=1e-12)
    np.testing.assert_allclose(first_passage_variance(moves, 2), first_passage_variance(written_out, 2), rtol=1e-12)


@FORMS
def test_hitting_probability_of_gamblers_ruin(form):
    n, p = 8, 0.45
    ruin = birth_death(np.r_[0.0, np.full(n - 1, p)], np.r_[np.full(n - 1, 1 - p), 0.0])
    odds = (1 - p) / p
    wins = (1 - odds ** np.arange(n + 1)) / (1 - odds**n)
    np.testing.assert_allclose(hitting_probability(form(ruin), n), wins, rtol=1e-12)
    # both ends are absorbing: of two that cannot both be hit, each is certain only from itself, and their sum is one
    np.testing.assert_allclose(hitting_probability(ruin, 0) + hitting_probability(ruin, n), 1, rtol=1e-12)
    assert mean_first_passage_time(form(ruin), n).tolist() == [np.inf] * n + [0.0]
    np.testing.assert_array_equal(np.isfinite(mean_first_passage_time(ruin, (0, n))), True)


def test_absorbing_and_unreachable_targets_are_exact():
    # 0 -> 1 -> 2 (absorbing), 3 leads in and is never reached, 4 is alone
    w = np.zeros((5, 5))
    w[0, 1] = w[1, 2] = 0.5
    w[3, 0] = 0.5
    assert hitting_probability(w, 2).tolist() == [1, 1, 1, 1, 0]
    assert hitting_probability(w, 3).tolist() == [0, 0, 0, 1, 0]
    assert mean_first_passage_time(w, 2).tolist() == pytest.approx([4, 2, 0, 6, np.inf])
    assert mean_first_passage_time(w, 3).tolist() == [np.inf, np.inf, np.inf, 0, np.inf]
    assert first_passage_variance(w, 4).tolist() == [np.inf] * 4 + [0]
    assert expected_visits(w, 0, 2).tolist() == pytest.approx([2, 2, 0, 0, 0])
    assert expected_visits(w, 0, 4).tolist() == pytest.approx([2, 2, np.inf, 0, 0])
    assert expected_visits(w, 4, 2).tolist() == [0, 0, 0, 0, np.inf]
    assert expected_visits(w, 2, 2).tolist() == [0] * 5
    assert mean_first_passage_time(w, ()).tolist() == [np.inf] * 5
    assert hitting_probability(w, range(5)).tolist() == [1] * 5


@pytest.mark.parametrize("letter", ["a", "c", "e", "g"])
def test_sensitivity_equals_numerical_slope(letter):
    unrolled = AugmentedGraph(NAMED_GRAPHS[letter], drop_key=True)
    weights = unrolled.weights.toarray()
    slopes = passage_time_sensitivity(weights, 0, unrolled.exit)
    assert set(zip(*slopes.nonzero(), strict=True)) <= set(zip(*weights[:-1].nonzero(), strict=True))
    for i, j, slope in zip(*sp.find(slopes), strict=True):
        nudged = np.zeros_like(weights)
        nudged[i, j] = 1e-6
        more = mean_first_passage_time(weights + nudged, unrolled.exit)[0]
        less = mean_first_passage_time(weights - nudged, unrolled.exit)[0]
        assert slope == pytest.approx((more - less) / 2e-6, rel=1e-4, abs=1e-2)


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        ([[0.5, -0.1], [0.5, 0.5]], r"finite weights that are not negative, but W\[0, 1\] is -0.1"),
        ([[0.5, 0.5], [np.nan, 0.5]], r"W\[1, 0\] is nan"),
        (sp.csr_array(np.array([[0.0, 0.0], [-1.0, 0.0]])), r"W\[1, 0\] is -1"),
        ([[0.5, np.inf], [0.5, 0.5]], r"W\[0, 1\] is inf"),
        ([[0.5, 0.5]], "square matrix with at least one node"),
        (np.zeros((0, 0)), "square matrix with at least one node"),
        (np.zeros((2, 2, 2)), "square matrix"),
        ([["a", "b"], ["c", "d"]], "square matrix of numbers"),
        ([[0, 1j], [0, 0]], "square matrix of numbers: it holds complex numbers"),
        (sp.csr_array(np.array([[0, 1j], [0, 0]])), "square matrix of numbers: it holds complex numbers"),
        ([[0.0, 3.0], [1.0, 0.0]], "row 0 of W sums to 3 \\(2 too much\\); divide rates, counts or rounded numbers by"),
    ],
)
def test_invalid_weights_raise_input_error(weights, message):
    with pytest.raises(InputError, match=message) as caught:
        mean_first_passage_time(weights, 1)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("node", [2, -1, 0.5, True, "exit"])
def test_invalid_node_raises_input_error(node):
    with pytest.raises(InputError, match="a node must be a whole number from 0 to 1, not"):
        expected_visits(np.eye(2), node, 1)


def restarts(n):
    """A walk that goes on or starts anew with equal chance: 2^(n + 1) - 2 steps on average, 2^(n - i) visits of i."""
    w = np.zeros((n + 1, n + 1))
    w[np.arange(n), np.arange(1, n + 1)] = w[1:n, 0] = 0.5
    return w


def test_sensitivity_with_nearly_equal_large_means():
    slopes = passage_time_sensitivity(restarts(60), 0, 60)
    assert slopes[0, 1] == pytest.approx(-(2.0**61), rel=1e-12)  # 2^60 visits of 0, two steps saved by each


def test_sensitivity_has_only_walked_edges():
    w = np.zeros((5, 5))
    w[0, 1], w[0, 2], w[1, 3], w[2, 3], w[4, 0] = 0.25, 0.75, 1, 0.5, 1
    slopes = passage_time_sensitivity(w, 0, 3)
    edges = slopes.tocoo()
    assert set(zip(edges.row, edges.col, strict=True)) == {(0, 1), (0, 2), (1, 3), (2, 3)}
    # m = 2.75, 1, 2, 0 and v = 1, 0.25, 1.5
    assert [slopes[e] for e in ((0, 1), (0, 2), (1, 3), (2, 3))] == pytest.approx([-1.75, -0.75, -0.25, -3])


def test_targets_may_be_any_iterable():
    weights = np.diag([0.5, 0.5], 1)
    several, once = (passage_time_sensitivity(weights, 0, targets) for targets in ([2], iter([2])))
    assert (once.toarray() == several.toarray()).all()
    assert np.isfinite(once.data).all()


@pytest.mark.parametrize("chance_to_miss", [0.5, 1.0])
def test_sensitivity_is_nan_if_target_may_be_missed(chance_to_miss):
    w = np.zeros((3, 3))
    w[0, 1], w[0, 2] = chance_to_miss, 1 - chance_to_miss
    assert np.isnan(passage_time_sensitivity(w, 0, 2).data).all()


def test_target_may_be_an_array_without_axes():
    weights = [[0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0, 1]]
    assert mean_first_passage_time(weights, np.array(2)).tolist() == mean_first_passage_time(weights, 2).tolist()
