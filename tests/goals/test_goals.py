"""Goal graphs: the paper's table, errors for invalid graphs, files, and open goals."""

import networkx as nx
import numpy as np
import pytest

from hierroom.goals import (
    EXIT_GOAL,
    GOAL_NAMES,
    GOAL_VECTORS,
    NAMED_GRAPHS,
    NO_GOAL,
    GoalGraph,
    as_goal_graph,
    enumerate_graphs,
)
from hierroom.support.errors import InputError


@pytest.mark.parametrize(
    ("letter", "key_rooms", "exit_room", "exit_depth", "width"),
    [
        ("a", (0,), 1, 2, 1),
        ("b", (0, 0), 1, 2, 2),
        ("c", (0, 1), 2, 4, 1),
        ("d", (0, 0, 1), 2, 2, 2),
        ("e", (0, 0, 0), 3, 2, 3),
        ("f", (0, 0, 1), 3, 4, 2),
        ("g", (0, 1, 2), 3, 6, 1),
    ],
)
def test_named_graphs_match_the_paper(letter, key_rooms, exit_room, exit_depth, width):
    graph = GoalGraph.named(letter)
    assert (graph.key_rooms, graph.exit_room) == (key_rooms, exit_room)
    assert (graph.exit_depth, graph.width) == (exit_depth, width)
    assert graph.name == letter
    assert graph.n_rooms == len(key_rooms) + 1
    assert graph.n_goals == 2 * len(key_rooms) + 1


def test_depths_of_a_branching_graph():
    graph = GoalGraph((0, 1, 1, 2, 0), 4)
    assert graph.depths == (0, 1, 2, 2, 3, 1)
    assert (graph.exit_depth, graph.width) == (6, 2)
    assert graph.name == "keys-0-1-1-2-0-exit-4"


def test_renumbered_rooms_have_the_same_canonical_graph():
    renamed = GoalGraph((3, 0, 0), 2)
    assert renamed != NAMED_GRAPHS["d"]
    assert renamed.canonical() == NAMED_GRAPHS["d"].canonical()
    assert renamed.name == "d"
    assert GoalGraph((3, 0, 0), 3).name != "d"


def test_goal_graph_is_hashable_and_immutable():
    graph = GoalGraph([0, np.int64(1)], np.int64(2))  # type: ignore[arg-type]
    assert graph == NAMED_GRAPHS["c"]
    assert hash(graph) == hash(NAMED_GRAPHS["c"])
    with pytest.raises(AttributeError):
        graph.exit_room = 1  # type: ignore[misc]
    assert repr(GoalGraph((0, 1), 2, "mine")) == "GoalGraph(key_rooms=(0, 1), exit_room=2)"


HUGE = (
    (10**5000, 2, r"key_rooms takes a list of whole numbers \(rooms\), not a huge int"),
    ((0,), 10**5000, "the exit must be in a room from 1 to 1, behind a door, not in a huge int"),
)


@pytest.mark.parametrize(
    ("key_rooms", "exit_room", "message"),
    [
        ((), 1, "a goal graph needs at least one locked room: key_rooms is empty"),
        ((0, 3), 1, "the key of room 2 must be in a room from 0 to 2, not in 3"),
        ((0, -1), 1, "the key of room 2 must be in a room from 0 to 2, not in -1"),
        ((0,), 0, "the exit must be in a room from 1 to 1, behind a door, not in 0"),
        ((0, 0), 3, "the exit must be in a room from 1 to 2, behind a door, not in 3"),
        ((0, 0), -1, "the exit must be in a room from 1 to 2, behind a door, not in -1"),
        ((1,), 1, r"key_rooms must form a tree rooted at room 0, but the key of room 1 is behind a cycle: \[1\]"),
        ((0, 3, 2), 1, r"the key of room 2 is behind a cycle: \[0, 3, 2\]"),
        ((0, 0.5), 1, "key_rooms takes whole numbers"),
        ("01", 1, "key_rooms takes a list of whole numbers"),
        ((True,), 1, "key_rooms takes whole numbers"),
        (None, 1, r"key_rooms takes a list of whole numbers \(rooms\), not None"),
        ((0,), "1", "exit_room takes whole numbers"),
        *(pytest.param(*case, id=f"huge int {n}") for n, case in enumerate(HUGE)),
        ((10**5000,), 1, "the key of room 1 must be in a room from 0 to 1, not in a huge int"),
        (np.array("a"), 2, r"key_rooms takes a list of whole numbers \(rooms\), not a ndarray"),
        ((0,), np.array("a"), "exit_room takes whole numbers"),
    ],
)
def test_invalid_goal_graph_raises_input_error(key_rooms, exit_room, message):
    with pytest.raises(InputError, match=message) as caught:
        GoalGraph(key_rooms, exit_room)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("graph", [*NAMED_GRAPHS.values(), GoalGraph((0, 1, 2, 3, 4, 5, 6, 7, 8), 9)])
def test_toml_round_trip(graph, tmp_path):
    path = tmp_path / "graph.toml"
    assert graph.to_toml(path) == path.read_text()
    assert GoalGraph.from_toml(path) == as_goal_graph(path) == as_goal_graph(str(path)) == graph


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("key_rooms = [0", "is not a TOML file"),
        ("", "has key_rooms, .* a name; this has nothing"),
        ("name = 3\nkey_rooms = [0]\nexit_room = 1", "graph.toml: the name of a goal graph must be a text of one line"),
        ('name = "c"\nkey_rooms = [0]\nexit_room = 1', "graph.toml: c is the name of another goal"),
        (
            'name = "keys-0-0-exit-1"\nkey_rooms = [0]\nexit_room = 1',
            "keys-0-0-exit-1 is the name of another goal",
        ),
        ('name = "keys-9-exit-1"\nkey_rooms = [0]\nexit_room = 1', "the key of room 1 must be in a room from 0 to 1"),
        ('name = "rooms:3"\nkey_rooms = [0]\nexit_room = 1', "graph.toml: 'rooms:3' means a set of goal graphs; give"),
        ("key_rooms = 0\nexit_room = 1", "graph.toml: key_rooms takes a list of whole numbers \\(rooms\\), not 0"),
        ("key_rooms = [0]\nexit = 1", "this has exit, key_rooms"),
        ("key_rooms = [0]\nexit_room = 0", "graph.toml: the exit must be in a room from 1 to 1, behind a door"),
    ],
)
def test_invalid_toml_raises_input_error_with_the_file(text, message, tmp_path):
    path = tmp_path / "graph.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        as_goal_graph(path)
    assert "graph.toml" in str(caught.value)


def test_graph_from_file_has_the_file_name(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("key_rooms = [0, 1]\nexit_room = 2\n")
    assert GoalGraph.from_toml(path).name == "mine"
    assert GoalGraph.from_toml(path) == GoalGraph.named("c")
    path.write_text('name = "the \\"fork\\""\n' + path.read_text())
    assert GoalGraph.from_toml(path).name == 'the "fork"'


@pytest.mark.parametrize("name", ["c", "keys-0-1-exit-2"])
def test_file_named_like_another_graph_keeps_its_suffix(name, tmp_path):
    path = tmp_path / f"{name}.toml"
    GoalGraph((0,), 1).to_toml(path)
    assert GoalGraph.from_toml(path).name == f"{name}.toml"
    GoalGraph((0, 1), 2).to_toml(path)
    assert GoalGraph.from_toml(path).name == name


def test_label_is_validated_and_ignored_by_equality():
    assert GoalGraph((0,), 1, "x") == GoalGraph((0,), 1)
    assert hash(GoalGraph((0,), 1, "x")) == hash(GoalGraph((0,), 1))
    for wrong in ("", " ", "two\nlines", 3, "\x1b[31m"):
        with pytest.raises(InputError, match="must be a text of one line"):
            GoalGraph((0,), 1, wrong)


def test_as_goal_graph_takes_a_dict():
    assert as_goal_graph({"key_rooms": [0, 1], "exit_room": 2}) == GoalGraph.named("c")
    for table in ({"key_rooms": [0, 1]}, 5, ["key_rooms", "exit_room"], None):
        with pytest.raises(InputError, match="a goal graph has key_rooms, exit_room and perhaps a name"):
            GoalGraph.from_dict(table)


def test_unreadable_file_raises_input_error(tmp_path):
    with pytest.raises(InputError, match=r"cannot read the goal graph .*missing.toml: No such file"):
        as_goal_graph(tmp_path / "missing.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=r"cannot read the goal graph .* it is no text in UTF-8"):
        as_goal_graph(tmp_path / "bytes.toml")


@pytest.mark.parametrize("graph", ["h", "ab", "", 3, None, (0, 1)])
def test_unknown_graph_raises_input_error(graph):
    with pytest.raises(InputError, match="a graph must be a letter from a to g, a name such as keys-0-1-exit-2"):
        as_goal_graph(graph)
    with pytest.raises(InputError, match=r"by a letter from a to g, or like .*, not"):
        GoalGraph.named(graph)


def test_every_graph_is_found_by_its_name():
    for graph in enumerate_graphs(5):
        assert (as_goal_graph(graph.name), as_goal_graph(graph.name).name) == (graph, graph.name)


def test_graph_name_with_rooms_keeps_their_numbers():
    graph = as_goal_graph("keys-2-0-exit-1")
    assert (graph.key_rooms, graph.exit_room, graph.name) == ((2, 0), 1, "keys-2-0-exit-1")
    assert graph.canonical() == GoalGraph.named("c").canonical()


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("keys-0-exit", "not 'keys-0-exit'"),
        ("keys-00-exit-1", "not 'keys-00-exit-1'"),
        ("keys-0--1-exit-1", "not 'keys-0--1-exit-1'"),
        ("keys-0-exit-1\n", "not 'keys-0-exit-1"),
        ("keys-0-exit-01", "not 'keys-0-exit-01'"),
        ("keys-0-9-exit-1", "the key of room 2 must be in a room from 0 to 2, not in 9"),
        ("keys-0-1.toml", "cannot read the goal graph keys-0-1.toml"),
    ],
)
def test_invalid_graph_name_raises_input_error(name, error):
    with pytest.raises(InputError, match=error):
        as_goal_graph(name)


def test_goal_vectors_encode_kind_and_colour():
    assert GOAL_VECTORS.shape == (14, 9)
    assert GOAL_NAMES[3] == "purple key"
    assert GOAL_VECTORS[3].tolist() == [1, 0, 0, 0, 0, 0, 1, 0, 0]
    assert GOAL_NAMES[6 + 5] == "grey door"
    assert GOAL_VECTORS[6 + 5].tolist() == [0, 1, 0, 0, 0, 0, 0, 0, 1]
    assert GOAL_NAMES[EXIT_GOAL] == "exit"
    assert GOAL_VECTORS[EXIT_GOAL].tolist() == [0, 0, 1, 0, 1, 0, 0, 0, 0]  # MiniGrid's goal is green
    assert GOAL_VECTORS[NO_GOAL].tolist() == [0] * 9
    assert len(np.unique(GOAL_VECTORS, axis=0)) == 14
    with pytest.raises(ValueError, match="read-only"):
        GOAL_VECTORS[0, 0] = 5


def test_to_networkx_gives_the_papers_dependency_graph():
    graph = NAMED_GRAPHS["d"].to_networkx()
    assert set(graph.edges) == {
        ("start", "key 1"), ("key 1", "door 1"), ("start", "key 2"), ("key 2", "door 2"),
        ("door 1", "key 3"), ("key 3", "door 3"), ("door 2", "exit"),
    }  # fmt: skip
    rooms = nx.get_node_attributes(graph, "room")
    assert (rooms["start"], rooms["exit"]) == (0, 2)


def test_unwritable_toml_file_raises_input_error(tmp_path):
    with pytest.raises(InputError, match=r"cannot write .*c\.toml: No such file or directory"):
        GoalGraph.named("c").to_toml(tmp_path / "nowhere" / "c.toml")
