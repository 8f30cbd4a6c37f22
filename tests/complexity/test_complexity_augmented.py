"""The augmented graph: its nodes and edges by hand, its counts, its symmetries."""

import networkx as nx
import numpy as np
import pytest

from hierroom.complexity import AugmentedGraph, Walk, analyze, count_nodes
from hierroom.complexity.augmented import MAX_NODES, alike_nodes
from hierroom.goals import NAMED_GRAPHS, GoalGraph, enumerate_graphs
from hierroom.support.errors import InputError


def drawn(unrolled):
    return nx.DiGraph([(unrolled.labels[i], unrolled.labels[j]) for i, j in unrolled.edges])


def test_augmented_graph_c_by_hand():
    unrolled = drawn(AugmentedGraph(NAMED_GRAPHS["c"]))
    levels = {
        "start": {"key 1, all closed"},
        "key 1, all closed": {"room 1, open 1"},
        "start, open 1": {"room 1, open 1", "key 2, open 1"},
        "room 1, open 1": {"start, open 1", "key 2, open 1"},
        "key 2, open 1": {"room 2, open 1 2"},
        "start, open 1 2": {"room 1, open 1 2", "room 2, open 1 2"},
        "room 1, open 1 2": {"start, open 1 2", "room 2, open 1 2"},
        "room 2, open 1 2": {"start, open 1 2", "room 1, open 1 2", "exit"},
        "exit": set(),
    }
    assert {node: set(unrolled[node]) for node in unrolled} == levels


def test_dropping_a_key_leads_back_to_every_room_accessible_before():
    plain = drawn(AugmentedGraph(NAMED_GRAPHS["c"]))
    dropping = drawn(AugmentedGraph(NAMED_GRAPHS["c"], drop_key=True))
    assert set(dropping.edges) - set(plain.edges) == {
        ("key 1, all closed", "start"),
        ("key 2, open 1", "start, open 1"),
        ("key 2, open 1", "room 1, open 1"),
    }


@pytest.mark.parametrize("drop_key", [False, True])
@pytest.mark.parametrize("letter", NAMED_GRAPHS)
def test_weights_equal_the_walk_probabilities(letter, drop_key):
    unrolled = AugmentedGraph(NAMED_GRAPHS[letter], drop_key)
    chances = unrolled.weights.toarray()
    totals = chances.sum(axis=1)
    assert totals[unrolled.start] == pytest.approx(0.19)
    assert totals[unrolled.exit] == pytest.approx(0.01)
    assert totals[1:-1] == pytest.approx(0.20)
    assert (chances[1:, unrolled.start] >= 0.01).all()
    moves = nx.to_numpy_array(drawn(unrolled), nodelist=unrolled.labels)
    moves *= 0.19 / np.maximum(moves.sum(axis=1, keepdims=True), 1)
    moves[1:, unrolled.start] += 0.01
    np.testing.assert_allclose(chances, moves, atol=1e-15)


@pytest.mark.parametrize("n_rooms", [2, 3, 4, 5, 6])
def test_count_nodes_equals_the_built_graph(n_rooms):
    for graph in enumerate_graphs(n_rooms):
        unrolled = AugmentedGraph(graph)
        assert count_nodes(graph) == len(unrolled.nodes) == len(set(unrolled.labels))
        assert nx.is_strongly_connected(nx.from_scipy_sparse_array(unrolled.weights, create_using=nx.DiGraph))


def test_too_many_nodes_raise_input_error():
    with pytest.raises(InputError, match=f"at most {MAX_NODES:,} nodes.*41 rooms"):
        analyze(GoalGraph((0,) * 40, 1))


@pytest.mark.parametrize("drop_key", [False, True])
def test_alike_nodes_have_equal_reach_probabilities(drop_key):
    unrolled = AugmentedGraph(GoalGraph((0, 0, 0, 1, 2), 3), drop_key)
    nodes, multiplicity = alike_nodes(unrolled)
    assert multiplicity.sum() == len(unrolled.nodes)
    assert len(nodes) < len(unrolled.nodes)
    report = analyze(unrolled.graph, drop_key)
    every_node = sum(report.reach_probability([7, 90], goal=label) for label in unrolled.labels)
    np.testing.assert_allclose(report.expected_states([7, 90]), every_node, atol=1e-10)


def test_a_graph_without_symmetry_has_no_alike_nodes():
    assert (alike_nodes(AugmentedGraph(NAMED_GRAPHS["d"]))[1] == 1).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Walk(0.8, 0.3, 0.1), "must sum to 1, not 1.2"),
        (lambda: Walk(1.2, -0.1, -0.1), "must be from 0 to 1, not"),
        (lambda: Walk(float("nan"), 0.5, 0.5), "must be from 0 to 1, not"),
        (lambda: analyze("h"), "a graph must be a letter from a to g"),
        (lambda: analyze(GoalGraph((2, 1), 1)), "must form a tree rooted at room 0"),
        (lambda: analyze(GoalGraph((0, 3, 2), 3)), "must form a tree.*the key of room 2 is behind a cycle"),
    ],
)
def test_invalid_walks_and_graphs_raise_input_error(make, message):
    with pytest.raises(InputError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)
