"""Sets of goal graphs: every way to give one, each graph once, exclusions however rooms are numbered, and errors."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hierroom.complexity import GraphSet, Walk, analyze
from hierroom.goals import MAX_GRID_ROOMS, NAMED_GRAPHS, GoalGraph, enumerate_graphs
from hierroom.support.errors import InputError

FORK = GoalGraph((0, 1, 1), 3)
"""Two rooms behind one: no graph of the paper."""


def canonical(graphs):
    return {graph.canonical() for graph in graphs}


def renumbered(graph, rng):
    order = rng.permutation(graph.n_rooms - 1) + 1
    new = {0: 0, **{old: int(position) for old, position in enumerate(order, start=1)}}
    key_rooms = {new[room]: new[home] for room, home in enumerate(graph.key_rooms, start=1)}
    return GoalGraph(tuple(key_rooms[room] for room in range(1, graph.n_rooms)), new[graph.exit_room])


single_graphs = st.one_of(
    st.sampled_from([*NAMED_GRAPHS]),
    st.builds(
        lambda index, seed: renumbered(enumerate_graphs(4)[index], np.random.default_rng(seed)),
        st.integers(0, 8),
        st.integers(0, 99),
    ),
)
all_specs = st.one_of(
    single_graphs, st.sampled_from(["rooms:2", "rooms:3", "rooms:4", "hitting_time:8..16", "expected_steps:90..150"])
)


@settings(max_examples=20)
@given(st.lists(all_specs, min_size=1, max_size=4))
def test_several_specs_are_the_union_of_each(specs):
    graphs = GraphSet(specs).graphs
    assert canonical(graphs) == set().union(*(canonical(GraphSet(spec).graphs) for spec in specs))
    assert len(canonical(graphs)) == len(graphs)  # each once
    assert canonical(graphs) == canonical(GraphSet(specs[::-1] + specs).graphs)


@settings(max_examples=20)
@given(st.lists(all_specs, min_size=1, max_size=3), st.lists(all_specs, min_size=1, max_size=2))
def test_exclusion_is_a_set_difference_or_input_error(specs, exclude):
    whole, parts = canonical(GraphSet(specs).graphs), [canonical(GraphSet(spec).graphs) for spec in exclude]
    left = whole - set().union(*parts)
    if left and all(part & whole for part in parts):
        assert canonical(GraphSet(specs, exclude).graphs) == left
    else:
        with pytest.raises(InputError, match=r"cannot exclude|no goal graph is left"):
            GraphSet(specs, exclude)


@settings(max_examples=20)
@given(st.integers(0, 8), st.integers(0, 99))
def test_exclusion_ignores_the_numbering_of_rooms(index, seed):
    graph = enumerate_graphs(4)[index]
    other = renumbered(graph, np.random.default_rng(seed))
    assert set(GraphSet("rooms:4", other).graphs) == set(enumerate_graphs(4)) - {graph}


@settings(max_examples=20)
@given(st.lists(all_specs, min_size=1, max_size=3), st.integers(1, 6))
def test_stages_have_each_graph_once_and_get_harder(specs, n_stages):
    graphs = GraphSet(specs)
    stages = graphs.stages(n_stages)
    assert len(stages) <= n_stages
    assert sorted(sum(stages, ()), key=repr) == sorted(graphs.graphs, key=repr)
    values = {graph: value for value, graph in graphs.difficulties}
    for easier, harder in pairwise(stages):
        assert max(values[graph] for graph in easier) < min(values[graph] for graph in harder)


def test_single_graph_keeps_its_room_numbers():
    odd = GoalGraph((3, 0, 0), 2)
    assert odd.canonical() == GoalGraph.named("d").canonical()
    assert GraphSet(odd).graphs == (odd,)
    assert odd in GraphSet(["rooms:4", odd]).graphs  # also where a set holds it too
    assert GraphSet(["d", odd]).graphs == (GoalGraph.named("d"),)  # of several the first


def test_interval_selects_its_graphs_easiest_first():
    few = {graph for n_rooms in range(2, 7) for graph in enumerate_graphs(n_rooms)}
    found = GraphSet("hitting_time:20..30").graphs
    assert {*found} & few == {graph for graph in few if 20 <= analyze(graph).hitting_time <= 30}
    assert max(graph.n_rooms for graph in found) == MAX_GRID_ROOMS
    values = [analyze(graph).hitting_time for graph in found]
    assert values == sorted(values)


def test_interval_uses_given_walk_and_drop_key():
    walk = Walk(0.5, 0.4, 0.1)
    found = GraphSet("expected_steps:20..40", drop_key=True, walk=walk).graphs
    assert found
    values = [analyze(graph, True, walk).expected_steps for graph in found]
    assert values == sorted(values)
    assert 20 <= values[0] <= values[-1] <= 40


def test_interval_is_cut_into_stages_of_equal_width():
    graphs = GraphSet("hitting_time:8..90")
    value = {graph: analyze(graph).hitting_time for graph in graphs.graphs}
    edges = np.linspace(8, 90, 8)
    parts = [tuple(g for g in graphs.graphs if low <= value[g] < high) for low, high in pairwise(edges)]
    assert graphs.stages(7) == tuple(part for part in parts if part)
    less = GraphSet("hitting_time:8..90", "c").stages(7)
    assert less == tuple(tuple(g for g in part if g != GoalGraph.named("c").canonical()) for part in graphs.stages(7))


def test_other_sets_are_staged_by_expected_steps():
    graphs = GraphSet(["g", "a", "c", "e"])  # 154.5, 28.0, 73.8 and 112.7 expected steps
    letters = [[graph.name for graph in stage] for stage in graphs.stages(2)]
    assert letters == [["a", "c"], ["e", "g"]]
    assert [[graph.name for graph in stage] for stage in graphs.stages(5)] == [["a"], ["c"], ["e"], ["g"]]


def test_graphs_keep_the_names_of_users(tmp_path):
    own = tmp_path / "fork.toml"
    FORK.to_toml(own)
    names = [graph.name for graph in GraphSet(["c", own, "rooms:4"]).graphs]
    assert names[:2] == ["c", "fork"]
    assert "keys-0-1-1-exit-3" not in names
    assert {"d", "e", "f", "g"} <= set(names)


def test_two_graphs_with_one_name_raise_input_error(tmp_path):
    paths = [tmp_path / folder / "own.toml" for folder in ("one", "two")]
    for path, graph in zip(paths, (FORK, GoalGraph((0, 0, 1), 2)), strict=True):
        path.parent.mkdir()
        graph.to_toml(path)
    with pytest.raises(InputError, match="two different goal graphs are named own"):
        GraphSet(["a", *paths], exclude=paths)
    with pytest.raises(InputError, match="two different goal graphs are named own; name one of them otherwise"):
        GraphSet(paths)
    paths[1].write_text(f'name = "other"\n{paths[1].read_text()}')
    assert [graph.name for graph in GraphSet(paths).graphs] == ["own", "other"]
    FORK.to_toml(paths[1])
    assert GraphSet(paths).graphs == (FORK,)  # the same graph twice


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["hitting_time:20-30"], "must be rooms:N, hitting_time:LOW..HIGH or .*not 'hitting_time:20-30'"),
        (["hitting_time:30..20"], "from low to high, not from 30 to 20"),
        (["hitting_time:1..2"], r"up to 7 rooms has hitting_time in 1\.\.2; the values go from 8.36"),
        (["rooms:8"], "rooms:N takes a number of rooms from 2 to 7, not 8"),
        ([["a", "z"]], "a graph must be a letter from a to g.*not 'z'"),
        ([[]], "give at least one goal graph"),
        ([["a", "b"], "c"], "cannot exclude c: it is not among the goal graphs of a and b"),
        (["g", "rooms:3"], "cannot exclude rooms:3: none of its graphs is among the goal graphs of g"),
        (["rooms:2", "a"], "no goal graph is left of rooms:2: all are excluded"),
    ],
)
def test_invalid_graph_sets_raise_input_error(arguments, message):
    with pytest.raises(InputError, match=message) as caught:
        GraphSet(*arguments)
    assert "\n" not in str(caught.value)


def test_equal_graphs_are_taken_once_with_a_note():
    twin = GoalGraph((2, 0), 1, label="mine")
    chosen = GraphSet(["c", twin, "rooms:3", "c", twin])
    assert chosen.alike == (("mine", "c"),)
    assert chosen.notes == [
        "goal graphs c and mine are the same, but for names and the numbers of rooms, and are taken once",
        "c is given twice among the goal graphs, and is taken once",
        "mine is given twice among the goal graphs, and is taken once",
    ]
    assert chosen.graphs[0].name == "c"
    assert GraphSet(["c", "b"]).notes == GraphSet("c").notes == []
