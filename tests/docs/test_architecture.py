"""The package is built as docs/architecture.md draws it: floors, arrows, no circle, few files."""

import re

import architecture
import networkx as nx
import pytest

PAGE = (architecture.ROOT / "docs" / "architecture.md").read_text()
DRAWING = re.search(r"```mermaid\n(.*?)```", PAGE, re.DOTALL)[1]


def parts():
    return architecture.imports_between(architecture.part_of)


def test_no_file_imports_in_a_circle():
    assert list(nx.simple_cycles(architecture.file_imports())) == []
    assert list(nx.simple_cycles(parts())) == []


def test_the_drawing_has_every_room_and_arrow():
    assert architecture.drawing() == DRAWING


def test_the_table_names_every_room():
    table = PAGE.split("| room |")[1].split("\n## ")[0]
    rooms = {
        name.strip("/")
        for row in table.splitlines()
        for name in re.findall(r"`([\w/]+)`", row.split("|")[1:2][0] if "|" in row else "")
    }
    assert rooms == set(parts())


def test_files_named_on_the_page_exist():
    for path in re.findall(r"`([\w/]+\.py)`", PAGE):
        assert (architecture.PACKAGE / path).is_file() or (architecture.ROOT / path).is_file(), path


def test_package_has_few_rooms_and_imports():
    rooms = architecture.imports_between(architecture.room_of)
    assert parts().number_of_nodes() <= 22
    assert parts().number_of_edges() <= 117
    assert rooms.number_of_nodes() <= 34
    assert rooms.number_of_edges() <= 200
    assert sum(rooms.has_edge(target, source) for source, target in rooms.edges) <= 2 * 4


def test_complexity_and_learners_import_few_parts():
    assert set(parts()["complexity"]) <= {"goals", "support"}
    assert set(parts()["learners"]) <= {"support"}


def test_class_names_are_unique():
    names = [name for path in architecture.files() for name in re.findall(r"(?m)^class (\w+)", path.read_text())]
    assert sorted(names) == sorted(set(names))


@pytest.mark.parametrize("path", architecture.files(), ids=lambda path: path.relative_to(architecture.ROOT).as_posix())
def test_no_file_is_long(path):
    assert len(path.read_text().splitlines()) <= 300
