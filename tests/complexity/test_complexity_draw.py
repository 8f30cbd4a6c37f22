"""Drawings of goal graphs and augmented graphs: their content, formats and errors."""

import networkx as nx
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import ArrowStyle, FancyArrowPatch
from pictures import has_colour, pixels

from hierroom.complexity import AugmentedGraph, analyze
from hierroom.complexity.augmented import kinds_of_nodes
from hierroom.complexity.drawing.draw import EXIT_COLOUR, INK, ROOM_COLOURS, draw_augmented, draw_goal_graph
from hierroom.complexity.drawing.draw_state import HALF_HEIGHT, rules_picture
from hierroom.complexity.drawing.drawn_places import place_augmented, place_goals
from hierroom.goals import NAMED_GRAPHS, GoalGraph, Rules, enumerate_graphs
from hierroom.support.errors import InputError


@pytest.fixture
def drawn(monkeypatch):
    """The texts of the last picture written, goal graph and augmented graph."""
    texts: list[list[str]] = []
    save = Figure.savefig

    def keep(figure, *args, **kwargs):
        texts[:] = [[text.get_text() for text in axes.texts] for axes in figure.axes]
        save(figure, *args, **kwargs)

    monkeypatch.setattr(Figure, "savefig", keep)
    return texts


@pytest.mark.parametrize("letter", NAMED_GRAPHS)
def test_every_goal_node_and_level_is_drawn(tmp_path, drawn, letter):
    unrolled = AugmentedGraph(NAMED_GRAPHS[letter], drop_key=True)
    path = tmp_path / "graph.png"
    analyze(unrolled.graph, drop_key=True).draw(path)
    assert path.read_bytes()[:4] == b"\x89PNG"
    colours = pixels(path)
    assert (colours[0] == 255).all()  # on white
    for colour in (*ROOM_COLOURS[: unrolled.graph.n_rooms], EXIT_COLOUR, INK):
        assert has_colour(colours, colour, tolerance=1).sum() > 500, colour
    goals, nodes = drawn
    assert sorted(name.replace("\n", " ") for name in goals) == sorted(unrolled.graph.to_networkx())
    boxes, kinds = place_augmented(unrolled), kinds_of_nodes(unrolled)
    leading_to_exit = sum(unrolled.graph.exit_room in box.doors for box in boxes)
    counts = sum(place.count > 1 for box in boxes for place in (*box.rooms, *box.keys))
    assert len(nodes) == len(kinds) - 1 + leading_to_exit + len(boxes) + counts
    assert nodes.count("exit") == leading_to_exit
    assert {"all doors closed", "all doors open"} <= set(nodes)


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


DRAWN = [
    *(AugmentedGraph(graph, drop) for graph in (*enumerate_graphs(5), NAMED_GRAPHS["e"]) for drop in (False, True)),
    AugmentedGraph(GoalGraph(tuple(range(8)), 8), True),
    AugmentedGraph(GoalGraph((0,) * 9, 1), True),
]


@pytest.mark.parametrize("unrolled", DRAWN, ids=lambda unrolled: f"{unrolled.graph.name}-{unrolled.drop_key}")
def test_boxes_never_overlap_and_cover_all_nodes(unrolled):
    boxes = place_augmented(unrolled)
    places = [place for box in boxes for place in (*box.rooms, *box.keys)]
    at = [place.at for place in places] + [box.exit_at for box in boxes if box.exit_at is not None]
    gaps = [max(abs(a[0] - b[0]), abs(a[1] - b[1])) for i, a in enumerate(at) for b in at[:i]]
    assert min(gaps) > 1.0
    assert sum(box.count * place.count for box in boxes for place in (*box.rooms, *box.keys)) == len(unrolled.nodes) - 1
    assert sum(box.count for box in boxes) == len(unrolled.levels)
    for i, one in enumerate(boxes):
        for other in boxes[:i]:
            beside = one.corner[0] >= other.corner[0] + other.size[0] or other.corner[0] >= one.corner[0] + one.size[0]
            below = one.corner[1] + one.size[1] <= other.corner[1]
            assert beside or below, (one.doors, other.doors)
        for x, y in [place.at for place in (*one.rooms, *one.keys)]:
            assert one.corner[0] + 0.5 < x < one.corner[0] + one.size[0] - 0.5
            assert one.corner[1] + 0.5 < y < one.corner[1] + one.size[1] - 0.5


@pytest.mark.slow
@pytest.mark.parametrize(
    "graph", [GoalGraph((0, 0, 0, 1, 2), 5), GoalGraph(tuple(range(6)), 6), GoalGraph((0,) * 6, 1)]
)
def test_six_and_seven_rooms_fit_on_a_screen(tmp_path, graph):
    analyze(graph, drop_key=True).draw(tmp_path / "graph.png")
    height, width, _ = pixels(tmp_path / "graph.png").shape
    assert max(height, width) <= 2200


def test_drawings_use_the_given_axes():
    left, right = Figure().subplots(1, 2)
    draw_goal_graph(NAMED_GRAPHS["c"], left)
    draw_augmented(AugmentedGraph(NAMED_GRAPHS["c"]), right, scale=0.6)
    assert "door\n2" in [text.get_text() for text in left.texts]
    assert "exit" in [text.get_text() for text in right.texts]
    assert {text.get_fontsize() for text in right.texts} == {8.5 * 0.6, 9 * 0.6}


def test_drawn_goals_never_overlap():
    for graph in enumerate_graphs(5):
        places = list(place_goals(graph).values())
        gaps = [abs(a[0] - b[0]) + abs(a[1] - b[1]) for i, a in enumerate(places) for b in places[:i]]
        assert min(gaps) > 1.0


@pytest.mark.parametrize(
    ("graph", "name", "message"),
    [
        (NAMED_GRAPHS["a"], "graph.xyz", r"^drawings are written as \.png, \.pdf, \.svg, not as graph\.xyz$"),
        (NAMED_GRAPHS["a"], "missing/graph.png", "there is no folder .*missing$"),
        (NAMED_GRAPHS["a"], ".", "^a drawing is a file, not the folder "),
        (GoalGraph((0, 0, 0, 1, 1, 2, 4, 5), 8), "graph.png", "at most 250 nodes that differ; .* has \\d{3}"),
    ],
)
def test_invalid_drawings_raise_input_error(tmp_path, graph, name, message):
    with pytest.raises(InputError, match=message):
        analyze(graph).draw(tmp_path / name)
    assert not [*tmp_path.iterdir()]


def test_dollar_signs_in_names_are_not_tex(tmp_path):
    """Matplotlib would read what stands between dollar signs as TeX, and fail."""
    path = tmp_path / "graph.svg"
    analyze(GoalGraph((0,), 1, label=r"$\bad$")).draw(path)
    assert path.read_bytes()


def texts_of(figure):
    """The extents in pixels of a figure's texts, by their words, without the labels of hidden axes."""
    FigureCanvasAgg(figure).draw()
    shown = [figure._supxlabel, *(text for axes in figure.axes for text in (axes.title, *axes.texts))]
    return [(text.get_text(), text.get_window_extent()) for text in shown if text.get_text()]


def line_of(names):
    return nx.relabel_nodes(nx.path_graph(len(names)), dict(enumerate(names)))


LONG = "a very long name of a goal in <words> & \\signs{$} " * 2
DEEP = Rules({f"goal {i}": {"needs": [f"goal {i - 1}"] * (i > 0), "gives": f"goal {i}"} for i in range(20)}, "goal 19")


@pytest.mark.parametrize(
    ("subject", "ends"),
    [
        (line_of([*map(str, range(40))]), {"source": "0", "target": "39"}),
        (line_of(["start", LONG, f"{LONG}2", "line\nbreak", "exit"]), {}),
        (nx.star_graph(39), {"source": 0, "target": 39}),
        (DEEP, {}),
        (Rules({LONG: {"gives": "b"}, f"{LONG}2": {"needs": "b", "gives": LONG}}, LONG), {}),
        (GoalGraph(tuple(range(9)), 9), {}),
        (GoalGraph((0, 0, 0), 1, label=LONG.strip()), {}),
    ],
    ids=["line", "long names", "star", "deep rules", "long goals", "deep graph", "long title"],
)
def test_arrows_and_texts_are_within_the_picture_and_texts_apart(subject, ends):
    figure = analyze(subject, **ends)._figure()
    texts = texts_of(figure)
    for words, box in texts:
        assert figure.bbox.x0 <= box.x0, words
        assert box.x1 <= figure.bbox.x1, words
    for axes in figure.axes:
        for arrow in (patch for patch in axes.patches if isinstance(patch, FancyArrowPatch)):
            assert axes.bbox.y0 <= arrow.get_window_extent().y0
            assert arrow.get_window_extent().y1 <= axes.bbox.y1
    for n, (words, box) in enumerate(texts):
        for others, other in texts[:n]:
            assert not box.overlaps(other), (words, others)


def test_chain_draws_moves_to_the_start_that_are_no_restarts():
    """Nodes 1 and 3 of a cycle lead to its start 0 by an edge, too; from 2, the target, only a restart does."""

    def n_heads(figure):
        arrows = [patch for patch in figure.axes[-1].patches if isinstance(patch, FancyArrowPatch)]
        return sum(1 + isinstance(arrow.get_arrowstyle(), ArrowStyle.CurveFilledAB) for arrow in arrows)

    report = analyze(nx.cycle_graph(4), source=0, target=2)
    figure = report._figure()
    assert figure.axes[0].get_title() == "chain\n4 nodes, 6 edges"
    assert n_heads(figure) == 6
    assert n_heads(analyze(report.chain)._figure()) == report.edges == 7


def test_picture_of_a_state_has_heads_on_arrows_in_a_row_and_keeps_names_apart():
    wide = Rules({"W" * 20: [{"gives": "a"}, {"needs": "b", "gives": "a"}], "M" * 20: {"gives": "b"}}, "a")
    picture = rules_picture(wide, frozenset(), (0, 0), None)[:44]
    inked = (picture.min(axis=2) < 200).sum(axis=0)  # pixels of each column
    sides = np.flatnonzero(inked > 2 * HALF_HEIGHT)
    assert len(sides) == 2 * 4, "the sides of two boxes, two pixels wide"
    between = inked[sides[3] + 1 : sides[4]]
    assert (between.min(), between.max()) == (0, 7), "a gap, and the head of the arrow"
