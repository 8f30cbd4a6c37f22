"""Elimination without subtraction against fractions: walks of ten steps and of 10^200, near and far from certain."""

import numpy as np
import pytest
import scipy.sparse as sp
from exact_walks import passage_exactly
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hierroom.complexity import (
    AugmentedGraph,
    Walk,
    analyze,
    expected_visits,
    first_passage_variance,
    hitting_probability,
    mean_first_passage_time,
    passage_time_sensitivity,
)
from hierroom.complexity.chains import elimination as module
from hierroom.complexity.chains.elimination import Elimination
from hierroom.goals import GoalGraph
from hierroom.support.errors import InputError


@st.composite
def walks(draw):
    """W [n, n] of walks that surely reach the last node, with probabilities down to 2^-120."""
    n = draw(st.integers(2, 7))
    exponents = st.one_of(st.none(), st.integers(3, 6), st.integers(3, 120))
    weights = np.zeros((n, n))
    for i in range(n - 1):
        for j in range(n):
            exponent = draw(exponents)
            weights[i, j] = 0.0 if i == j or exponent is None else draw(st.floats(0.5, 1)) * 2.0**-exponent
        if draw(st.booleans()):
            weights[i] /= max(weights[i].sum(), 1e-300)  # leaves at every step
        if not weights[i, i + 1]:
            weights[i, i + 1] = 2.0 ** -draw(st.integers(20, 120))
    return np.minimum(weights, 1.0) / np.maximum(weights.sum(axis=1), 1)[:, None]


@settings(max_examples=100)
@given(walks())
@example(np.diag([1.0, 1.0, 1.0], 1))  # no variance at all
@example(np.diag([0.5, 2.0**-60, 0.5], 1) + np.diag([0.5, 0.5, 0.5], -1))
def test_means_and_variances_of_ill_conditioned_walks(weights):
    target = len(weights) - 1
    means, variances = passage_exactly(weights, target)
    np.testing.assert_allclose(mean_first_passage_time(weights, target), np.array(means, float), rtol=1e-13)
    found = first_passage_variance(weights, target)
    np.testing.assert_allclose(found, np.array(variances, float), rtol=1e-11, atol=1e-13 * float(max(means)) ** 2)


def test_mean_beyond_floats_raises_input_error():
    weights = np.array([[0, 1e-200, 0], [0.5, 0, 1e-200], [0, 0, 0]])
    for attempt in (mean_first_passage_time, lambda weights, target: expected_visits(weights, 0, target)):
        with pytest.raises(InputError, match=r"at most about 1e\+290 steps"):
            attempt(weights, 2)


@settings(max_examples=60)
@given(walks())
def test_visits_of_ill_conditioned_walks(weights):
    target = len(weights) - 1
    for i in range(target):
        slower = weights.copy()
        slower[i] /= 2  # every visit to i now takes twice the steps
        more = float(passage_exactly(slower, target)[0][0] - passage_exactly(weights, target)[0][0])
        assert expected_visits(weights, 0, target)[i] == pytest.approx(more, rel=1e-12, abs=0)


def test_tiny_hitting_probabilities_are_accurate():
    up, down = 2.0**-30, 0.5
    ruin = np.diag([0.0] + [up] * 5, 1) + np.diag([down] * 5 + [0.0], -1)
    odds = down / up
    wins = hitting_probability(ruin, 6)
    exact = [(odds**i - 1) / (odds**6 - 1) for i in range(7)]
    np.testing.assert_allclose(wins, exact, rtol=1e-13)
    assert 0 < wins[1] < 1e-40


@pytest.mark.parametrize(
    ("n_doors", "walk", "expected"),
    [
        # computed in 60 digits; elimination with subtraction gave 3.4e17, 3.794e14 and 3179151606
        (19, Walk(), 4355606319268949020.1099),
        (16, Walk(), 379553213318583.1126),
        (8, Walk(0, 0.5, 0.5), 3179151358.000000384),
    ],
)
def test_expected_steps_of_long_room_chains(n_doors, walk, expected):
    report = analyze(GoalGraph(tuple(range(n_doors)), n_doors), walk.stay > 0, walk)
    assert report.expected_steps == pytest.approx(expected, rel=1e-14)
    assert report.std == pytest.approx(expected, rel=1e-7)  # nearly geometric, so its deviation is its mean


def test_sensitivities_of_a_long_walk():
    """Slopes are made of differences of means, which for long walks are less than the floats resolve."""
    unrolled = AugmentedGraph(GoalGraph(tuple(range(8)), 8), drop_key=True, walk=Walk(0.5, 0.1, 0.4))
    weights = unrolled.weights.toarray()
    means, _ = passage_exactly(weights, unrolled.exit)
    assert means[0] > 10**12
    slopes = passage_time_sensitivity(weights, 0, unrolled.exit)
    visits = expected_visits(weights, 0, unrolled.exit)
    for i, j, slope in zip(*sp.find(slopes), strict=True):
        scale = visits[i] * float(abs(means[i] - means[0]) + 1)
        assert slope == pytest.approx(visits[i] * float(means[j] - means[i]), rel=1e-10, abs=1e-13 * scale)
    report = analyze(GoalGraph(tuple(range(19)), 19), True)
    assert sum(edge.elasticity for edge in report.chain.edge_sensitivity()) == pytest.approx(-1, rel=1e-11)


@pytest.mark.parametrize("n", [1, 2, 130])
def test_elimination_at_several_sizes(n):
    rng = np.random.default_rng(n)
    moves = rng.random((n, n)) * (rng.random((n, n)) < 0.1)
    np.fill_diagonal(moves, 0)
    leaving = rng.random(n) * 0.1 + 1e-3
    system = np.diag(moves.sum(axis=1) + leaving) - moves
    elimination = Elimination(sp.csr_array(moves), leaving)
    b = rng.random(n)
    np.testing.assert_allclose(elimination.solve(b), np.linalg.solve(system, b), rtol=1e-10)
    np.testing.assert_allclose(elimination.solve_transposed(b), np.linalg.solve(system.T, b), rtol=1e-10)


def test_compiled_kernel_equals_its_own_source(monkeypatch):
    unrolled = AugmentedGraph(GoalGraph((0, 0, 1, 2), 4), drop_key=True)
    moves, leaving = unrolled.weights[:-1][:, :-1], np.ones(len(unrolled.nodes) - 1) * 1e-3
    compiled = Elimination(moves, leaving).solve(np.ones(len(leaving)))
    for kernel in ("_eliminate", "_solve"):
        monkeypatch.setattr(module, kernel, getattr(module, kernel).py_func)
    assert Elimination(moves, leaving).solve(np.ones(len(leaving))).tolist() == compiled.tolist()


def test_walk_too_long_for_floats_raises_input_error():
    with pytest.raises(InputError, match=r"at most about 1e\+290 steps, as 64-bit floats"):
        analyze(GoalGraph(tuple(range(20)), 20), True, Walk(0, 1e-8, 1 - 1e-8)).expected_steps  # noqa: B018
    report = analyze(GoalGraph(tuple(range(15)), 15), True, Walk(0, 1e-6, 1 - 1e-6))
    assert report.expected_steps > 1e180
    assert report.std == np.inf


def test_empty_system_has_an_empty_solution():
    empty = Elimination(sp.csr_array((0, 0)), np.empty(0))
    assert empty.solve([]).shape == empty.solve_transposed([]).shape == (0,)


def test_rate_below_least_rate_raises_input_error():
    alone = sp.csr_array((1, 1))
    assert Elimination(alone, np.array([module.LEAST_RATE])).solve([1.0]) == 1 / module.LEAST_RATE
    with pytest.raises(InputError, match="a walk may take at most about"):
        Elimination(alone, np.array([module.LEAST_RATE / 2]))


def test_self_loops_are_ignored():
    moves, leaving = np.random.default_rng(2).random((6, 6)), np.array([0, 0, 0.5, 0, 0, 0.1])
    others = moves * (1 - np.eye(6))
    found, expected = (Elimination(sp.csr_array(each), leaving).solve(np.arange(6)) for each in (moves, others))
    np.testing.assert_allclose(found, expected, rtol=1e-14)
