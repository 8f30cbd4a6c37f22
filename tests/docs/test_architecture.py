"""The package is built as docs/architecture.md draws it: floors, arrows, no circle, few files."""

import importlib
import re

import architecture
import networkx as nx
import pytest

PAGE = (architecture.ROOT / "docs" / "architecture.md").read_text()
DRAWING = re.search(r"```mermaid\n(.*?)```", PAGE, re.DOTALL)[1]


def test_no_file_imports_in_a_circle():
    assert list(nx.simple_cycles(architecture.file_imports())) == []
    assert list(nx.simple_cycles(architecture.part_imports())) == []


def test_the_drawing_has_every_part_on_its_floor():
    drawn = [block.split() for block in re.findall(r"subgraph f\d+ \[\d+\]\n(.*?)\n    end", DRAWING, re.DOTALL)]
    assert [sorted(parts) for parts in drawn] == architecture.floors()


def test_drawing_has_every_import_arrow_not_implied():
    lines = re.findall(r"^    (\S.*) --> (\S+)$", DRAWING, re.MULTILINE)
    drawn = {(above, below) for several, below in lines for above in several.split(" & ")}
    assert drawn == set(nx.transitive_reduction(architecture.part_imports()).edges)


def test_the_table_names_every_room():
    table = PAGE.split("| room |")[1].split("\n## ")[0]
    rooms = {
        name.strip("/")
        for row in table.splitlines()
        for name in re.findall(r"`([\w/]+)`", row.split("|")[1:2][0] if "|" in row else "")
    }
    assert rooms == set(architecture.part_imports())


def test_files_named_on_the_page_exist():
    for path in re.findall(r"`([\w/]+\.py)`", PAGE):
        assert (architecture.PACKAGE / path).is_file() or (architecture.ROOT / path).is_file(), path


def test_package_has_few_floors_rooms_and_imports():
    graph = architecture.part_imports()
    assert len(architecture.floors()) <= 11
    assert graph.number_of_nodes() <= 24
    assert graph.number_of_edges() <= 130
    assert len(list(architecture.PACKAGE.glob("*.py"))) <= 10


def test_complexity_and_learners_import_few_parts():
    assert set(architecture.part_imports()["complexity"]) <= {"goals", "support"}
    assert set(architecture.part_imports()["learners"]) <= {"support"}


def test_class_names_are_unique():
    names = [
        node.name
        for path in architecture.files()
        for node in architecture.ast.parse(path.read_text()).body
        if isinstance(node, architecture.ast.ClassDef)
    ]
    assert sorted(names) == sorted(set(names))


@pytest.mark.parametrize("path", architecture.files(), ids=lambda path: path.relative_to(architecture.ROOT).as_posix())
def test_no_file_is_long(path):
    assert len(path.read_text().splitlines()) <= 300


CONTRIBUTING = (architecture.ROOT / "CONTRIBUTING.md").read_text()
TABLE = [row for row in CONTRIBUTING.split("equation stands")[1].split("\n## ")[0].splitlines() if row.startswith("|")]
EQUATIONS = [name for row in TABLE for name in re.findall(r"`([a-z_]+\.[\w.]+)`", row)]


@pytest.mark.parametrize("name", EQUATIONS)
def test_each_equation_of_the_table_exists(name):
    words = ["hierroom", *name.split(".")]
    for end in range(len(words), 0, -1):
        try:
            found = importlib.import_module(".".join(words[:end]))
        except ModuleNotFoundError:
            continue
        for word in words[end:]:
            found = getattr(found, word)
        assert found is not None
        return
    pytest.fail(name)


def test_table_has_at_least_15_equations():
    assert len(EQUATIONS) >= 15
