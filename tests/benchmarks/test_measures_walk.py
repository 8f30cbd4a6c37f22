"""Measures of the long run of a walk against closed forms."""

import math

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.measures import walk
from benchmarks.measures.summary import measure_walk
from benchmarks.measures.walk import (
    committor,
    commute_time,
    cover_time,
    mixing_time,
    spectral_gap,
    stationary_distribution,
)
from hierroom.complexity import analyze


def uniform_walk(graph, stay=0.0):
    """W of the walk that leaves a node by each edge alike."""
    adjacency = nx.to_numpy_array(graph)
    return (1 - stay) * adjacency / adjacency.sum(axis=1, keepdims=True)


@given(st.floats(0.01, 1.0), st.floats(0.01, 1.0))
def test_measures_of_a_walk_on_two_nodes(there, back):
    """pi = (back, there) / (there + back); the other eigenvalue is 1 - there - back; E T = 1 / there."""
    weights = np.array([[0, there], [back, 0]])
    pi, other = np.array([back, there]) / (there + back), abs(1 - there - back)
    np.testing.assert_allclose(stationary_distribution(weights), pi)
    assert spectral_gap(weights) == pytest.approx(1 - other, abs=1e-9)
    assert commute_time(weights, 0, 1) == pytest.approx(1 / there + 1 / back)
    assert cover_time(weights, 0) == pytest.approx(1 / there)
    t = mixing_time(weights)
    if other < 1 - 1e-9:
        far = [pi.max() * other**steps for steps in (t - 1, t)]
        assert far[1] <= 0.25 * (1 + 1e-6)
        assert t == 0 or far[0] > 0.25 * (1 - 1e-6)


def test_a_walk_that_swaps_two_nodes_never_mixes():
    weights = np.array([[0.0, 1.0], [1.0, 0.0]])
    assert mixing_time(weights) == math.inf
    assert spectral_gap(weights) == 0


@pytest.mark.parametrize("n", [3, 5, 8])
def test_cover_times_equal_closed_forms(n):
    """Complete graph (n - 1) H_(n-1), cycle n (n - 1) / 2, path from its end (n - 1)^2."""
    harmonic = sum(1 / i for i in range(1, n))
    assert cover_time(uniform_walk(nx.complete_graph(n)), 0) == pytest.approx((n - 1) * harmonic)
    assert cover_time(uniform_walk(nx.cycle_graph(n)), 0) == pytest.approx(n * (n - 1) / 2)
    assert cover_time(uniform_walk(nx.path_graph(n)), 0) == pytest.approx((n - 1) ** 2)
    assert cover_time(uniform_walk(nx.cycle_graph(n), stay=0.75), 0) == pytest.approx(2 * n * (n - 1))


def test_commute_times_equal_effective_resistances():
    """2 |E| times the effective resistance (Levin and Peres, proposition 10.7), which networkx has."""
    graph = nx.petersen_graph()
    weights = uniform_walk(graph)
    for target in (1, 7):
        expected = 2 * graph.number_of_edges() * nx.resistance_distance(graph, 0, target)
        assert commute_time(weights, 0, target) == pytest.approx(expected)


def test_committors_of_the_gamblers_ruin():
    weights = uniform_walk(nx.path_graph(7))
    np.testing.assert_allclose(committor(weights, 0, 6), np.arange(7) / 6)
    np.testing.assert_allclose(committor(weights, [0, 6], 3)[[0, 1, 3, 5, 6]], [0, 1 / 3, 1, 1 / 3, 0])


@pytest.mark.parametrize("most_dense_nodes", [2000, 10])
@pytest.mark.parametrize("n", [60, 200])
def test_spectral_gap_of_a_corridor_in_any_order(n, most_dense_nodes, monkeypatch):
    """Its eigenvalues are 1 and 2 sqrt(f b) cos(pi k / n), with the chances f and b to go ahead and back."""
    monkeypatch.setattr(walk, "MAX_DENSE_NODES", most_dense_nodes)
    weights = np.diag(np.full(n - 1, 0.9), 1) + np.diag(np.full(n - 1, 0.1), -1)
    order = np.random.default_rng(1).permutation(n)
    for one in (weights, weights[order][:, order]):
        assert spectral_gap(one) == pytest.approx(1 - 0.6 * math.cos(math.pi / n), rel=1e-9)


def test_measures_of_the_papers_walk():
    """The commute time is the mean time to the exit and 100 steps, the mean time until the walk restarts."""
    chain = analyze("c").chain
    found = measure_walk(chain)
    assert found.commute == pytest.approx(chain.expected_steps + 100)
    assert found.at_exit == pytest.approx(stationary_distribution(chain.weights)[-1])
    assert (found.nodes, found.cover_error) == (9, 0.0)
    assert found.cover >= chain.expected_steps
    leaves = chain.weights[[0]].sum()
    assert found.at_exit * 0.01 == pytest.approx(stationary_distribution(chain.weights)[0] * leaves * found.escape)
