"""Drawings of goal graphs and rules: their content, formats and errors."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch
from pictures import has_colour, pixels

from hierroom.complexity import analyze
from hierroom.complexity.draw import DONE, PURSUED, rules_picture
from hierroom.goals import NAMED_GRAPHS, GoalGraph, Rules
from hierroom.support.errors import InputError
from hierroom.support.layers import APART, place_layers
from hierroom.support.sheet import EXIT_COLOUR, INK, ROOM_COLOURS, USED_COLOUR


def texts_of(figure):
    return [text.get_text() for text in figure.axes[0].texts if text.get_text()]


def arrows_of(figure):
    return [patch for patch in figure.axes[0].patches if isinstance(patch, FancyArrowPatch)]


@pytest.mark.parametrize("letter", NAMED_GRAPHS)
def test_every_goal_node_and_set_of_doors_is_drawn(tmp_path, letter):
    report = analyze(NAMED_GRAPHS[letter], drop_key=True)
    path, unrolled = tmp_path / "graph.png", report.augmented
    report.draw(path)
    colours = pixels(path)
    assert (colours[0] == 255).all()  # on white
    for colour in (*ROOM_COLOURS[: unrolled.graph.n_rooms], EXIT_COLOUR, INK):
        assert has_colour(colours, colour, tolerance=1).sum() > 500, colour
    texts = texts_of(report._figure())
    for goal in unrolled.graph.to_networkx():
        assert goal in texts
    kinds = {"room": "r", "key": "k"}
    names = [f"{kinds[node.kind]}{node.room}" if node.room else "start" for node in unrolled.nodes[:-1]]
    for name in {*names}:
        assert texts.count(name) == names.count(name) + (name == "start"), name
    n_exits = sum(unrolled.graph.exit_room in doors for doors in unrolled.levels)
    assert texts.count("exit") == n_exits + 1
    assert [text for text in texts if text.startswith("all")] == ["all closed", "all open"]
    assert sum(text.startswith("open: ") for text in texts) == len(unrolled.levels) - 2
    n_keys = sum(node.kind == "key" for node in unrolled.nodes)
    assert len(arrows_of(report._figure())) == len(unrolled.graph.to_networkx().edges) + 2 * n_keys + n_exits


@pytest.mark.parametrize(
    ("drop_key", "said"),
    [(False, "grey arrow: from each of them"), (True, "back to each of them, as a key is dropped")],
)
def test_notes_say_how_the_augmented_graph_is_read(drop_key, said):
    assert said in texts_of(analyze("f", drop_key)._figure())[-1]


def test_of_rules_and_large_graphs_only_the_goals_are_drawn():
    facts = [f"f{i}" for i in range(13)]
    many = Rules({fact: {"gives": fact} for fact in facts} | {"t": {"needs": facts, "gives": "t"}}, "t")
    assert texts_of(analyze(many)._figure()) == ["rules\ntarget t", *facts, "t"]
    star = texts_of(analyze(GoalGraph((0,) * 6, 1))._figure())
    assert star[-1] == "not drawn: the augmented graph, 449 nodes"
    assert star.count("door 6") == 1


@pytest.mark.parametrize(
    ("name", "written", "start"),
    [("c.PDF", "c.PDF", b"%PDF"), ("c.svg", "c.svg", b"<?xml"), ("c", "c.png", b"\x89PNG")],
)
def test_file_suffix_chooses_the_format(tmp_path, name, written, start):
    analyze(NAMED_GRAPHS["c"]).draw(tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == [written]
    assert (tmp_path / written).read_bytes().startswith(start)


def test_failed_drawing_keeps_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "graph.png"
    analyze(NAMED_GRAPHS["a"]).draw(path)
    old = path.read_bytes()

    def fail(figure, file, **_):
        file.write(b"half a picture")
        raise ValueError("the ink is dry")

    monkeypatch.setattr(Figure, "savefig", fail)
    with pytest.raises(ValueError, match="the ink is dry"):
        analyze(NAMED_GRAPHS["b"]).draw(path)
    assert path.read_bytes() == old
    assert [*tmp_path.iterdir()] == [path]


@pytest.mark.parametrize(
    ("graph", "name", "message"),
    [
        (NAMED_GRAPHS["a"], "graph.xyz", r"^drawings are written as \.png, \.pdf, \.svg, not as graph\.xyz$"),
        (NAMED_GRAPHS["a"], "missing/graph.png", "there is no folder .*missing$"),
        (NAMED_GRAPHS["a"], ".", "^a drawing is a file, not the folder "),
    ],
)
def test_invalid_drawings_raise_input_error(tmp_path, graph, name, message):
    with pytest.raises(InputError, match=message):
        analyze(graph).draw(tmp_path / name)
    assert not [*tmp_path.iterdir()]


def line_of_rules(n):
    return Rules(
        {f"goal {i}": {"needs": [f"goal {i - 1}"] * (i > 0), "gives": f"goal {i}"} for i in range(n)}, f"goal {n - 1}"
    )


LONG = "a very long name of a goal in <words> & \\signs{$} " * 2
LIFE = Rules(
    {
        "freeze": {"uses": "water", "gives": "ice"},
        "thaw": {"uses": "ice", "gives": "water"},
        "grow": [{"needs": "water", "gives": "tree"}, {"needs": "ice", "gives": "tree"}],
    },
    "tree",
    start={"water": 1},
)
DRAWN = {
    "no dollar signs as TeX": lambda: analyze(GoalGraph((0,), 1, label=r"$\bad$")),
    "deep rules": lambda: analyze(line_of_rules(30)),
    "long goals": lambda: analyze(Rules({LONG: {"gives": "b"}, f"{LONG}2": {"needs": "b", "gives": LONG}}, LONG)),
    "rules in a circle": lambda: analyze(LIFE),
    "deep graph": lambda: analyze(GoalGraph(tuple(range(9)), 9)),
    "wide graph": lambda: analyze(GoalGraph((0,) * 4, 1), drop_key=True),
    "long title": lambda: analyze(GoalGraph((0, 0, 0), 1, label=LONG.strip())),
}


@pytest.mark.parametrize("name", DRAWN)
def test_all_is_within_the_picture_and_texts_are_apart(name):
    figure = DRAWN[name]()._figure()
    FigureCanvasAgg(figure).draw()
    axes = figure.axes[0]
    texts = [(text.get_text(), text.get_window_extent()) for text in axes.texts if text.get_text()]
    for extent in (*(box for _, box in texts), *(patch.get_window_extent() for patch in axes.patches)):
        assert figure.bbox.x0 <= extent.x0 <= extent.x1 <= figure.bbox.x1
        assert figure.bbox.y0 <= extent.y0 <= extent.y1 <= figure.bbox.y1
    for n, (words, box) in enumerate(texts):
        for others, other in texts[:n]:
            assert not box.overlaps(other), (words, others)


def test_thirty_goals_are_legible():
    """Letters are 9 points high, on a sheet of less than 18 inches."""
    figure = analyze(line_of_rules(30))._figure()
    assert {text.get_fontsize() for text in figure.axes[0].texts} == {8.0, 9.0, 10.0}
    assert max(figure.get_size_inches()) < 18


@pytest.mark.parametrize(
    ("last", "n_black", "n_red"),
    [
        ({"needs": ["a", "b"], "gives": "c"}, 2, 0),
        ({"needs": "b", "uses": "a", "gives": "c"}, 2, 1),
        ([{"needs": "b", "gives": "c"}, {"needs": "a", "gives": "c"}], 3, 0),
    ],
)
def test_needs_that_follow_from_others_are_not_drawn(last, n_black, n_red):
    """B needs A, so that it goes without saying that C needs A; but not with alternatives, nor what is used up."""
    figure = analyze(Rules({"a": {"gives": "a"}, "b": {"needs": "a", "gives": "b"}, "c": last}, "c"))._figure()
    colours = [to_hex(arrow.get_edgecolor()) for arrow in arrows_of(figure)]
    assert (colours.count(INK), colours.count(USED_COLOUR)) == (n_black, n_red)
    assert ("needs that follow from others" in texts_of(figure)[-1]) == (n_black + n_red < 3)


edges_of_ten = st.lists(st.tuples(*[st.integers(0, 9)] * 2).filter(lambda edge: edge[0] != edge[1]), max_size=30)


@given(edges_of_ten, st.lists(st.integers(0, 4), min_size=10, max_size=10), st.booleans())
def test_nodes_and_long_arrows_in_layers_are_apart(edges, layers, is_down):
    sizes = [(10.0 + 5 * n, 40.0 - 3 * n) for n in range(10)]
    layout = place_layers(sizes, layers, edges, is_down)
    places, halves = np.array(layout.places), np.array(sizes) / 2
    corners = [*zip(places - halves, places + halves, strict=True)]
    assert min(low.min() for low, _ in corners) >= -1e-9
    assert (np.max([high for _, high in corners], axis=0) <= np.array(layout.size) + 1e-9).all()
    for n, (low, high) in enumerate(corners):
        for other_low, other_high in corners[:n]:
            assert max((low - other_high).max(), (other_low - high).max()) >= APART - 1e-9
    assert {*layout.routes} == {(i, j) for i, j in edges if layers[i] <= layers[j]}
    for route in layout.routes.values():
        for x, y in route[1:-1]:
            assert not any((low < (x, y)).all() and ((x, y) < high).all() for low, high in corners)


def test_layers_are_across_where_that_is_smaller():
    deep, wide = (place_layers([(50.0, 20.0)] * 12, layers, []) for layers in (range(12), [0] * 12))
    assert deep.size[0] == 50
    assert wide.size == (50, 12 * 20 + 11 * APART)


def test_picture_of_a_state_shows_counts_achieved_and_pursued_goals():
    rules = Rules(
        {"wood": {"gives": "wood"}, "raft": {"uses": {"wood": 2}, "gives": "raft"}}, "raft", capacity={"wood": 12}
    )
    pictures = [
        rules_picture(rules, frozenset(achieved), (count, 0), goal)
        for achieved, count, goal in (((), 0, None), (("wood",), 11, None), (("wood",), 11, "raft"))
    ]
    assert len({picture.shape for picture in pictures}) == 1
    assert [has_colour(picture, DONE).any() for picture in pictures] == [False, True, True]
    assert [has_colour(picture, PURSUED).any() for picture in pictures] == [False, False, True]
