"""The paper's hitting time against numpy's pseudo-inverse, exact fractions and effective resistances."""

import numpy as np
import pytest
import scipy.sparse as sp
from exact_walks import laplacian_exactly, solve_exactly

from hierroom.complexity import (
    AugmentedGraph,
    Chain,
    Walk,
    analyze,
    expected_visits,
    laplacian,
    laplacian_hitting_time,
    laplacian_sensitivity,
    mean_first_passage_time,
)
from hierroom.goals import NAMED_GRAPHS, GoalGraph, enumerate_graphs
from hierroom.support.errors import InputError

TO_TWO_DIGITS = {
    False: (8.36, 12.05, 15.07, 15.10, 17.09, 22.44, 27.50),
    True: (16.54, 25.16, 39.53, 30.23, 36.20, 64.14, 82.46),
}


def dense_hitting_time(weights, source, target):
    """Equation (1) of `hierroom.complexity.chains.laplacian` with numpy alone."""
    b = np.zeros(len(weights))
    b[source], b[target] = 1, -1
    # D - W is singular: NumPy's own tolerance is so small that its zero is divided by on some machines.
    return b @ np.linalg.pinv(np.diag(weights.sum(axis=1)) - weights, rcond=1e-12) @ b


@pytest.mark.parametrize("drop_key", [False, True])
def test_hitting_times_equal_the_papers_two_digits(drop_key):
    values = [analyze(letter, drop_key).hitting_time for letter in NAMED_GRAPHS]
    assert tuple(round(value, 2) for value in values) == TO_TWO_DIGITS[drop_key]


def corridor(n, ahead, back):
    return np.diag(np.full(n - 1, ahead), 1) + np.diag(np.full(n - 1, back), -1)


@pytest.mark.parametrize(("n", "ahead", "back"), [(6, 0.9, 0.001), (8, 0.9, 0.001), (20, 0.9, 0.1)])
def test_corridor_equals_exact_fractions_in_any_order(n, ahead, back):
    weights, b = corridor(n, ahead, back), [1] + [0] * (n - 2) + [-1]
    k = laplacian_exactly(weights)
    normal = [[sum(k[r][i] * k[r][j] for r in range(n)) + 1 for j in range(n)] for i in range(n)]
    x = solve_exactly(normal, [sum(k[r][i] * b[r] for r in range(n)) for i in range(n)])
    rng = np.random.default_rng(0)
    for order in (np.arange(n), np.arange(n)[::-1], *(rng.permutation(n) for _ in range(5))):
        source, target = (int(np.flatnonzero(order == node)[0]) for node in (0, n - 1))
        found = laplacian_hitting_time(weights[order][:, order], source, target)
        assert found == pytest.approx(float(x[0] - x[-1]), rel=1e-11)


def by_visits(chain, restart):
    visits = expected_visits(chain.weights, chain.source, chain.nodes_of("exit"))
    squares = visits @ visits
    return (visits[chain.source] + restart * squares) / (1 + restart**2 * squares)


@pytest.mark.parametrize("walk", [Walk(), Walk(0.5, 0.3, 0.2), Walk(0.9, 0.0999, 0.0001)])
@pytest.mark.parametrize("drop_key", [False, True])
@pytest.mark.parametrize("n_rooms", [2, 3, 4, 5])
def test_hitting_time_follows_from_visits_before_the_exit(n_rooms, drop_key, walk):
    """Equation (2) of `hierroom.complexity.chains.laplacian`."""
    for graph in enumerate_graphs(n_rooms):
        report = analyze(graph, drop_key, walk)
        assert report.hitting_time == pytest.approx(by_visits(report.chain, walk.restart), rel=1e-9)


def test_symmetric_weights_give_the_effective_resistance():
    resistors = np.array([2.0, 3.0, 5.0])
    in_a_row = np.diag(1 / resistors, 1) + np.diag(1 / resistors, -1)
    assert laplacian_hitting_time(in_a_row, 0, 3) == pytest.approx(10, rel=1e-12)
    complete = np.ones((6, 6)) - np.eye(6)
    assert laplacian_hitting_time(complete, 1, 4) == pytest.approx(2 / 6, rel=1e-12)


def test_hitting_time_saturates_at_inverse_restart_probability():
    rows = [analyze(GoalGraph(tuple(range(n_rooms - 1)), n_rooms - 1)) for n_rooms in (8, 20)]
    assert [round(row.hitting_time, 1) for row in rows] == [98.7, 100.0]
    assert rows[1].expected_steps > 1000 * rows[0].expected_steps
    rarer = analyze(rows[1].graph, walk=Walk(0.80, 0.195, 0.005))
    assert rarer.hitting_time == pytest.approx(200, rel=5e-3)


def test_random_walks_equal_the_pseudo_inverse():
    rng = np.random.default_rng(3)
    several_ends = compared = 0
    for _ in range(200):
        n = int(rng.integers(2, 9))
        weights = rng.random((n, n)) * (rng.random((n, n)) < rng.choice([0.15, 0.3, 0.6]))
        source, target = rng.choice(n, 2, replace=False).tolist()
        value = laplacian_hitting_time(weights, source, target)
        if np.isfinite(value):
            compared += 1
            several_ends += np.linalg.matrix_rank(laplacian(weights).toarray()) < n - 1
            assert value == pytest.approx(dense_hitting_time(weights, source, target), rel=1e-6, abs=1e-7)
        else:
            assert mean_first_passage_time(weights / n, target)[source] == np.inf
    assert compared > 50
    assert several_ends > 10


def test_unreachable_target_has_infinite_hitting_time():
    one_way = np.array([[0.0, 0.0], [0.3, 0.0]])
    assert laplacian_hitting_time(one_way, 0, 1) == np.inf
    assert laplacian_hitting_time(np.zeros((3, 3)), 0, 2) == np.inf
    assert laplacian_hitting_time(one_way, 1, 1) == 0


@pytest.mark.parametrize("drop_key", [False, True])
@pytest.mark.parametrize("letter", ["a", "d", "g"])
def test_sensitivity_equals_numerical_slope(letter, drop_key):
    unrolled = AugmentedGraph(NAMED_GRAPHS[letter], drop_key)
    compare_with_slopes(unrolled.weights.toarray(), unrolled.exit)


def compare_with_slopes(weights, target):
    for i, j, slope in zip(*sp.find(laplacian_sensitivity(weights, 0, target)), strict=True):
        nudged = np.zeros_like(weights)
        nudged[i, j] = 1e-6
        more = dense_hitting_time(weights + nudged, 0, target)
        less = dense_hitting_time(weights - nudged, 0, target)
        assert slope == pytest.approx((more - less) / 2e-6, rel=1e-4, abs=1e-2)


def test_sensitivity_allows_an_unreached_absorbing_node():
    """Node 2 leads to the target, 1, and to the absorbing node 3; the walk from 0 reaches neither 2 nor 3."""
    weights = np.array([[0, 0.5, 0, 0], [0.1, 0, 0, 0], [0.1, 0.3, 0, 0.2], [0, 0, 0, 0]])
    compare_with_slopes(weights, 1)
    (edge,) = Chain.from_matrix(weights, 0, 1).edge_sensitivity()
    assert (edge.steps_slope, edge.elasticity) == pytest.approx((-4, -1))
    assert edge.hitting_time_slope == laplacian_sensitivity(weights, 0, 1)[0, 1]


def test_sensitivity_of_infinite_hitting_time_is_nan():
    w = np.array([[0, 0.5, 0], [0.5, 0, 0], [0.3, 0, 0]])
    assert laplacian_hitting_time(w, 0, 2) == np.inf
    assert np.isnan(laplacian_sensitivity(w, 0, 2).data).all()


def test_sensitivity_with_two_reachable_ends_raises_input_error():
    with pytest.raises(InputError, match="2 parts that are never left"):
        laplacian_sensitivity(np.array([[0, 0.1, 0.1], [0, 0, 0], [0, 0, 0]]), 0, 1)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("measure", [laplacian_hitting_time, laplacian_sensitivity])
def test_weights_that_differ_too_much_raise_input_error(measure):
    with pytest.raises(InputError, match="64-bit floats cannot hold the solution"):
        measure([[0, 1e-200, 0], [1e-200, 0, 1e200], [0, 1e200, 0]], 0, 2)
