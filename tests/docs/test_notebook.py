"""Notebooks show goal graphs as drawings and reports as tables, which are well-formed for any names."""

from xml.etree import ElementTree

from hierroom import GoalGraph
from hierroom.complexity import analyze
from hierroom.support.tables import html_table

SVG = "{http://www.w3.org/2000/svg}"


def test_goal_graph_is_drawn_unless_it_is_large():
    graph = GoalGraph((0, 0, 1), 3, label="<mine> & $yours$")
    root = ElementTree.fromstring(graph._repr_svg_())
    assert root.tag == f"{SVG}svg"
    assert GoalGraph(tuple(range(2000)), 2000)._repr_svg_() is None


def test_report_html_equals_its_printed_text():
    report = analyze("f")
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
