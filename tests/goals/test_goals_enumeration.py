"""Enumeration of the goal graphs with a number of rooms, and the numbering and places of their rooms."""

from itertools import product

import networkx as nx
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hierroom.goals import GoalGraph, enumerate_graphs
from hierroom.goals.tree import canonical_rooms, child_rooms, tree_places
from hierroom.support.errors import InputError


def counts_by_generating_function(n_max):
    """Coefficients of T^2 / (1 - T) for n = 2..n_max: a tree with a marked node other than its root.

    T counts rooted trees by size: T(n + 1) = sum over k of (sum of d T(d) over divisors d of k) T(n - k + 1), over n.
    """
    trees = [0, 1]
    for n in range(1, n_max):
        full = sum(sum(d * trees[d] for d in range(1, k + 1) if k % d == 0) * trees[n - k + 1] for k in range(1, n + 1))
        trees.append(full // n)
    assert trees[:9] == [0, 1, 1, 2, 4, 9, 20, 48, 115]  # OEIS A000081
    # Down the path to the marked node stand k >= 2 trees: T^2 + T^3 + ...
    power, counts = trees, [0] * (n_max + 1)
    for _ in range(2, n_max + 1):
        power = [sum(power[i] * trees[n - i] for i in range(n + 1)) for n in range(n_max + 1)]
        counts = [a + b for a, b in zip(counts, power, strict=True)]
    return counts


def test_enumeration_counts_match_the_generating_function():
    counts = counts_by_generating_function(9)
    assert counts[2:] == [1, 3, 9, 26, 75, 214, 612, 1747]
    assert [len(enumerate_graphs(n)) for n in range(2, 10)] == counts[2:]


@pytest.mark.parametrize("n_rooms", [2, 3, 4, 5])
def test_enumeration_equals_brute_force(n_rooms):
    def as_tree(graph):
        tree = nx.DiGraph()
        tree.add_nodes_from((room, {"kind": (room == 0, room == graph.exit_room)}) for room in range(graph.n_rooms))
        tree.add_edges_from((key_room, room) for room, key_room in enumerate(graph.key_rooms, start=1))
        return tree

    listed = [as_tree(graph) for graph in enumerate_graphs(n_rooms)]
    n_valid = 0
    for *key_rooms, exit_room in product(range(n_rooms), repeat=n_rooms):
        try:
            tree = as_tree(GoalGraph(tuple(key_rooms), exit_room))
        except InputError:
            continue
        n_valid += 1
        assert sum(nx.is_isomorphic(tree, other, lambda a, b: a["kind"] == b["kind"]) for other in listed) == 1
    # Cayley: n^(n - 2) labelled trees, each with n - 1 rooms for the exit.
    assert n_valid == n_rooms ** (n_rooms - 2) * (n_rooms - 1)


def test_enumerated_graphs_are_canonical_and_sorted():
    graphs = enumerate_graphs(5)
    assert all(graph.canonical() == graph for graph in graphs)
    assert graphs == sorted(graphs, key=lambda graph: (graph.key_rooms, graph.exit_room))
    with pytest.raises(InputError, match="the number of rooms of goal graphs must be at least 2, not 1"):
        enumerate_graphs(1)


def test_among_equal_rooms_the_exit_is_numbered_first():
    assert GoalGraph((0, 0), 2).canonical() == GoalGraph((0, 0), 1)
    assert GoalGraph((0, 0, 1, 2), 4).canonical() == GoalGraph((0, 0, 1, 2), 3)


def test_greater_subtrees_are_numbered_first():
    """Room 1 has two rooms with a leaf each, room 2 a leaf and a room with two: the greater child decides."""
    assert canonical_rooms((0, 0, 1, 1, 2, 2, 3, 4, 6, 6), None) == ((0, 0, 1, 1, 2, 2, 3, 3, 5, 6), 0)
    assert canonical_rooms((0,), None) == ((0,), 0)


@given(st.integers(1, 8).flatmap(lambda n: st.tuples(*(st.integers(0, room) for room in range(n)))))
def test_places_of_a_tree_are_apart_and_below_their_parents(key_rooms):
    places, children = tree_places(key_rooms), child_rooms(key_rooms)
    assert places[0][1] == 0
    for room, below in enumerate(children):
        if below:
            assert places[room][0] == (places[below[0]][0] + places[below[-1]][0]) / 2
        assert {places[child][1] for child in below} <= {places[room][1] + 1}
    leaves = [column for (column, _), below in zip(places, children, strict=True) if not below]
    assert sorted(leaves) == list(range(len(leaves)))
    for n, (column, depth) in enumerate(places):
        assert all(abs(column - other) >= 1 for other, same in places[:n] if same == depth)
