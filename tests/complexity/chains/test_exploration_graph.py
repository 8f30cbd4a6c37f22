"""Chains on named nodes, and of any exploration graph, given as a graph of networkx or as a matrix."""

import math

import networkx as nx
import numpy as np
import pytest
import scipy.sparse as sp
import torch

from hierroom.complexity import Chain, Walk, analyze
from hierroom.support.errors import InputError

SIXTHS = np.full((6, 6), 1 / 6)


def test_matrix_nodes_take_labels():
    names = ["hall", "cellar", "garden"]
    chain = Chain.from_matrix([[0, 1, 1], [1, 0, 0], [0, 0, 0]], "hall", "garden", names, rates=True)
    assert chain.expected_steps == pytest.approx(3)
    assert repr(chain) == "<Chain: random walk on 3 nodes from hall to garden>"


@pytest.mark.parametrize(
    ("make", "arguments", "message"),
    [
        (Chain.from_networkx, (nx.path_graph(3), 0, 7), "no node 7 among the 3 nodes 0, 1, 2"),
        (Chain.from_networkx, (nx.path_graph("sab"), "s", "s"), "two nodes, but both are 's'"),
        (Chain.from_networkx, (nx.DiGraph([(0, 1, {"weight": 0.5}), (1, 0)]), 0, 1), "1 of 2 have it"),
        (Chain.from_networkx, (nx.DiGraph([(1, "1")]), 1, "1"), "two of them are called '1'"),
        (Chain.from_networkx, (nx.DiGraph([(0, 1, {"weight": 1j})]), 0, 1), "it holds complex numbers"),
        (Chain.from_networkx, ([(0, 1)], 0, 1), "must be a networkx graph with nodes, not a list"),
        (Chain.from_matrix, ([[0, 1], [1, 0]], 0, 1, 5), "the names of nodes must be a list of short texts"),
        (Chain.from_matrix, (np.eye(3), "attic", 1, ["hall", "cellar", "garden"]), "no node 'attic' among the 3 nodes"),
        (Chain.from_matrix, ([[0, 2], [1, 0]], 0, 1), "with rates=True"),
        (Chain.from_matrix, (np.round(SIXTHS, 4), 0, 1), r"row 0 of W sums to 1.0002 \(0.0002 too much\); divide"),
        (Chain.from_matrix, (np.float32(SIXTHS + 1e-6), 0, 1), r"row 0 of W sums to 1.00001 \(6.*e-06 too much\)"),
        (
            Chain.from_matrix,
            (torch.eye(2, requires_grad=True), 0, 1),
            "a square matrix of numbers: Can't call numpy",
        ),
    ],
)
def test_invalid_graphs_and_matrices_raise_input_error(make, arguments, message):
    with pytest.raises(InputError, match=message) as caught:
        make(*arguments)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("n", [3, 6, 12, 24])
def test_absorbing_target_has_no_hitting_time(n):
    """Its value would be the steps spent at the start, n - 1, while the mean is (n - 1)^2."""
    line = nx.path_graph(n).to_directed()
    line.remove_edge(n - 1, n - 2)
    chain = Chain.from_matrix(nx.to_numpy_array(line), 0, n - 1, rates=True)
    assert chain.expected_steps == pytest.approx((n - 1) ** 2)
    assert chain.is_one_way()
    assert math.isnan(chain.hitting_time)
    assert all(math.isnan(edge.hitting_time_slope) for edge in chain.edge_sensitivity())
    assert math.isnan(chain.hitting_time_to("1")), "nor has a node on the way there"
    assert math.isnan(analyze("c", walk=Walk(0.8, 0.2, 0.0)).hitting_time)


@pytest.mark.parametrize("leak", [0, 1, 5])
def test_walk_without_return_has_no_hitting_time(leak):
    """From the start, on the way or from the target: its value would be 5 again, the steps spent at the start."""
    line = nx.path_graph(6).to_directed()
    nx.add_cycle(line, ["elsewhere", "for ever"])
    assert math.isfinite(Chain.from_matrix(nx.to_numpy_array(line), 0, 5, rates=True).hitting_time)
    line.add_edge(leak, "elsewhere")
    assert math.isnan(Chain.from_matrix(nx.to_numpy_array(line), 0, 5, rates=True).hitting_time)


@pytest.mark.parametrize("drop_key", [False, True])
def test_papers_walk_on_networkx_equals_the_augmented_graph(drop_key):
    report = analyze("c", drop_key)
    unrolled = nx.DiGraph(report.augmented.edges.tolist())
    unrolled.add_edge(report.augmented.exit, 0)  # of a target only the restart counts
    unrolled.add_edge(0, 0)  # and no edge from a node to itself
    chain = Chain.from_networkx(unrolled, 0, report.augmented.exit)
    assert (chain.hitting_time, chain.expected_steps) == pytest.approx((report.hitting_time, report.expected_steps))


def test_papers_walk_divides_moves_by_edge_weights():
    """The start's edges weigh 1 + 1 and 2; the dead end has only the restart, and the target too."""
    graph = nx.MultiDiGraph([("s", "t"), ("s", "t"), ("s", "dead end"), ("t", "dead end")])
    chain = Chain.from_networkx(graph, "s", "t", walk=Walk(0.7, 0.2, 0.1))
    np.testing.assert_allclose(chain.weights.toarray(), [[0, 0.4 / 3, 0.2 / 3], [0.1, 0, 0], [0.1, 0, 0]])
    weighted = nx.DiGraph()
    weighted.add_weighted_edges_from([("s", "t", 3.0), ("s", "dead end", 1.0)])
    chain = Chain.from_networkx(weighted, "s", "t", walk=Walk(0.7, 0.2, 0.1))
    np.testing.assert_allclose(chain.weights.toarray(), [[0, 0.15, 0.05], [0.1, 0, 0], [0.1, 0, 0]])


@pytest.mark.parametrize("matrix", [np.float32(SIXTHS), sp.csr_array(np.float32(SIXTHS))])
def test_rows_may_exceed_one_by_rounding(matrix):
    chain = Chain.from_matrix(matrix, 0, 1)
    assert chain.weights.sum(axis=1).max() <= 1 + 1e-12
    assert chain.expected_steps == pytest.approx(6, rel=1e-6)
    assert Walk(*np.array([0.8, 0.19, 0.01], np.float32)).restart == pytest.approx(0.01)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("rate", [5e-324, 1e-310, 1e-300, 1.0, 1e300, 1.5e308])
def test_rates_of_any_size_are_divided_by_their_sum(rate):
    chain = Chain.from_matrix([[0, rate, rate], [1, 0, 0], [0, 0, 0]], 0, 2, rates=True)
    np.testing.assert_allclose(chain.weights.toarray(), [[0, 0.5, 0.5], [1, 0, 0], [0, 0, 0]])
    assert chain.expected_steps == pytest.approx(3)


W = sp.csr_array(np.array([[0.0, 0.5, 0.0], [0.1, 0.0, 0.2], [0.0, 0.0, 0.0]]))


@pytest.mark.parametrize(
    ("labels", "source", "goals", "message"),
    [
        (("a", "b"), 0, {"exit": (2,)}, "a chain of 3 nodes needs 3 labels, not 2"),
        (("a", "b", "a"), 0, {"exit": (2,)}, "nodes need different names, but two of them are called 'a'"),
        (("a", "b", "c"), 3, {"exit": (2,)}, "a node must be a whole number from 0 to 2, not 3"),
        (("a", "b", "c"), 0, {"key 1": (1,)}, "a chain needs a goal 'exit'; there is 'key 1'"),
        (("a", "b", "c"), 0, {}, "a chain needs a goal 'exit'; there is none"),
        (("a", "b", "c"), 0, {"exit": 2}, "the nodes of a goal must be a list of whole numbers, not 2"),
        (("a", "b", "c"), 0, {"exit": ()}, "the goal 'exit' of a chain must be one node, not 0"),
    ],
)
def test_invalid_chains_raise_input_error(labels, source, goals, message):
    with pytest.raises(InputError, match=message) as caught:
        Chain(W, labels, source, goals)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("label", ["key 9", "room 1", 3, None, ["exit"]])
def test_unknown_label_raises_input_error(label):
    chain = analyze("c").chain
    for ask in (
        chain.expected_steps_to, chain.hitting_time_to,
        lambda goal: chain.reach_probability([1, 2], goal),
    ):  # fmt: skip
        with pytest.raises(InputError, match=r"the goals are key 1, .*'start', .*; there is no") as caught:
            ask(label)
        assert "\n" not in str(caught.value)


def test_weights_of_any_form_give_the_same_chain():
    expected = Chain(W, ("a", "b", "c"), 0, {"exit": (2,)}).expected_steps
    for weights in (W.toarray(), sp.coo_array(W), sp.csc_array(W)):
        assert Chain(weights, ("a", "b", "c"), 0, {"exit": (2,)}).expected_steps == expected


def test_stored_zeros_are_no_edges():
    weights = sp.csr_array((np.array([0.0, 0.5, 0.5]), ([0, 0, 1], [2, 1, 0])), shape=(3, 3))
    chain = Chain(weights, ("a", "b", "c"), 0, {"exit": (1,)})
    assert not chain.is_one_way()
    assert chain.hitting_time == pytest.approx(2)


def test_rows_above_one_raise_input_error():
    with pytest.raises(InputError, match="row 0 of W sums to 2"):
        Chain(4 * W, ("a", "b", "c"), 0, {"exit": (2,)})
