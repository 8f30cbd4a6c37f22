"""Drawings: what is in them, and what is refused."""

import re
import zlib
from xml.etree import ElementTree

import pytest
from matplotlib.figure import Figure
from pictures import has_colour, pixels

from hierroom.complexity import AugmentedGraph
from hierroom.complexity.draw import EXIT_COLOUR, INK, ROOM_COLOURS, draw_graph
from hierroom.errors import InputError
from hierroom.goals import NAMED_GRAPHS, GoalGraph, enumerate_graphs


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
    draw_graph(unrolled, path)
    assert path.read_bytes()[:4] == b"\x89PNG"
    colours = pixels(path)
    assert (colours[0] == 255).all()  # on white
    for colour in (*ROOM_COLOURS[: unrolled.graph.n_rooms], EXIT_COLOUR, INK):
        assert has_colour(colours, colour, tolerance=1).sum() > 500, colour
    goals, nodes = drawn
    assert sorted(name.replace("\n", " ") for name in goals) == sorted(unrolled.graph.to_networkx())
    leading_to_exit = sum(unrolled.graph.exit_room in doors for doors in unrolled.levels)
    assert len(nodes) == len(unrolled.nodes) - 1 + leading_to_exit + len(unrolled.levels)
    assert nodes.count("exit") == leading_to_exit
    assert {"all doors closed", "all doors open"} <= set(nodes)


@pytest.mark.parametrize(
    ("name", "written", "start"),
    [("c.pdf", "c.pdf", b"%PDF"), ("c.svg", "c.svg", b"<?xml"), ("c", "c.png", b"\x89PNG")],
)
def test_the_suffix_chooses_the_format(tmp_path, drawn, name, written, start):
    draw_graph(AugmentedGraph(NAMED_GRAPHS["c"]), tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == [written]
    assert (tmp_path / written).read_bytes().startswith(start)
    size, said = READ[written[-3:]](tmp_path / written)
    draw_graph(AugmentedGraph(NAMED_GRAPHS["c"]), tmp_path / "same.png")
    height, width, _ = pixels(tmp_path / "same.png").shape
    assert size == pytest.approx((width * 72 / 150, height * 72 / 150), abs=0.5)  # in points
    if said is not None:
        texts = ["".join(text.split()) for text in (*drawn[0], *drawn[1])]
        assert len(texts) > 15
        assert all(said.count(text) >= texts.count(text) for text in texts)


def read_png(path):
    height, width, _ = pixels(path).shape
    return (width * 72 / 150, height * 72 / 150), None


def read_svg(path):
    """Size in points, and all texts without their white space; each is a comment above its letters."""
    content = path.read_text()
    root = ElementTree.fromstring(content)
    assert root.tag.endswith("svg")
    said = "".join("".join(re.findall("<!-- (.*?) -->", content, re.DOTALL)).split())
    return tuple(float(root.attrib[name].removesuffix("pt")) for name in ("width", "height")), said


def read_pdf(path):
    """The same of the only page, whose letters stand in brackets between the distances to the next."""
    content = path.read_bytes()
    assert content.rstrip().endswith(b"%%EOF")
    ((width, height),) = re.findall(rb"/MediaBox \[ 0 0 (\S+) (\S+) \]", content)
    page = max(map(zlib.decompress, re.findall(rb"stream\r?\n(.*?)endstream", content, re.DOTALL)), key=len)
    said = "".join(re.findall(r"\(([^()]*)\)", page.decode("latin-1"))).replace(" ", "")
    return (float(width), float(height)), said


READ = {"png": read_png, "svg": read_svg, "pdf": read_pdf}


def test_a_drawing_that_fails_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "graph.png"
    draw_graph(AugmentedGraph(NAMED_GRAPHS["a"]), path)
    old = path.read_bytes()

    def fail(figure, file, **_):
        file.write(b"half a picture")
        raise ValueError("the ink is dry")

    monkeypatch.setattr(Figure, "savefig", fail)
    with pytest.raises(InputError, match=r"cannot write the drawing .*graph\.png: the ink is dry"):
        draw_graph(AugmentedGraph(NAMED_GRAPHS["b"]), path)
    assert path.read_bytes() == old
    assert [*tmp_path.iterdir()] == [path]


def test_goals_never_overlap():
    from hierroom.complexity.draw import _goal_places

    for graph in enumerate_graphs(5):
        places = list(_goal_places(graph).values())
        gaps = [abs(a[0] - b[0]) + abs(a[1] - b[1]) for i, a in enumerate(places) for b in places[:i]]
        assert min(gaps) > 1.0


@pytest.mark.parametrize(
    ("graph", "name", "message"),
    [
        (NAMED_GRAPHS["a"], "graph.xyz", "cannot write the drawing .*xyz"),
        (NAMED_GRAPHS["a"], "missing/graph.png", "No such file or directory"),
        (GoalGraph((0,) * 6, 1), "graph.png", "at most 250 nodes; .* has 449"),
    ],
)
def test_one_clear_message(tmp_path, graph, name, message):
    with pytest.raises(InputError, match=message):
        draw_graph(AugmentedGraph(graph), tmp_path / name)
    assert not [*tmp_path.iterdir()]


def test_a_name_is_no_formula(tmp_path):
    """Matplotlib would read what stands between dollar signs as TeX, and fail."""
    path = tmp_path / "graph.svg"
    draw_graph(AugmentedGraph(GoalGraph((0,), 1, label=r"$\bad$")), path)
    assert path.read_bytes()
