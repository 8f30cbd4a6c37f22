"""Notebooks show goal graphs as drawings and reports as tables, which are well-formed for any names."""

from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hierroom import GoalGraph
from hierroom.complexity import analyze, measure_trajectories
from hierroom.complexity.observed import EpisodeCounts
from hierroom.complexity.played_chain import PlayedChain
from hierroom.support.tables import html_table

SVG = "{http://www.w3.org/2000/svg}"


@st.composite
def graphs(draw):
    n_rooms = draw(st.integers(2, 9))
    key_rooms = tuple(draw(st.integers(0, room)) for room in range(n_rooms - 1))
    return GoalGraph(key_rooms, draw(st.integers(1, n_rooms - 1)))


def test_deep_goal_graph_is_drawn():
    chain = GoalGraph(tuple(range(2000)), 2000)
    circles = [*ElementTree.fromstring(chain._repr_svg_()).iter(f"{SVG}circle")]
    assert len(circles) == 2001 + 1


@given(graphs())
def test_drawing_has_every_room_apart_within_borders(graph):
    root = ElementTree.fromstring(graph._repr_svg_())
    width, height = float(root.attrib["width"]), float(root.attrib["height"])
    circles = [circle.attrib for circle in root.iter(f"{SVG}circle")]
    rooms = [(float(one["cx"]), float(one["cy"])) for one in circles if one["fill"] != "none"]
    assert len(set(rooms)) == len(rooms) == graph.n_rooms
    assert len(circles) == graph.n_rooms + 1  # the exit's ring
    for x, y in rooms:
        assert 20 < x < width - 20
        assert 40 < y < height - 30
    assert all(
        abs(x - other_x) >= 39 or abs(y - other_y) >= 39
        for x, y in rooms
        for other_x, other_y in rooms
        if (x, y) != (other_x, other_y)
    )
    words = [text.text for text in root.iter(f"{SVG}text")]
    assert words.count("exit") == 1
    assert {f"key {room}" for room in range(1, graph.n_rooms)} <= set(words)
    assert len(list(root.iter(f"{SVG}line"))) == graph.n_rooms - 1


def measured_report():
    return PlayedChain.against(analyze("a"), EpisodeCounts.of([[0, 0, 1], [0, 0, 0]], 5, 0, 4), n_resamples=5)


def played_chain():
    return measure_trajectories([["hall", "<cellar>", "garden"], ["hall", "hall", "garden"]], "garden")


@pytest.mark.parametrize("make", [lambda: analyze("f"), measured_report, played_chain])
def test_report_html_equals_its_printed_text(make):
    report = make()
    shown = ElementTree.fromstring(f"<div>{report._repr_html_()}</div>")
    head, *lines = str(report).splitlines()
    assert shown.find("table/caption").text == head
    rows = [[cell.text or "" for cell in row] for row in shown.iter("tr")]
    notes = [note.text for note in shown.iter("p")]
    assert len(rows) > 5
    for line, cells in zip(lines, [*rows, *([note] for note in notes)], strict=True):
        assert line.split() == " ".join(cells).split()


def test_html_table_escapes_texts():
    table = html_table("<a>", ("b&",), [("<c>", "d<")], ["e>"])
    texts = [text for text in ElementTree.fromstring(f"<div>{table}</div>").itertext() if text]
    assert texts == ["<a>", "b&", "<c>", "d<", "e>"]
