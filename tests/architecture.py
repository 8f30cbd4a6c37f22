"""The structure of the package, read from its imports. ``python tests/architecture.py`` prints the drawing of the docs.

A part is a file or a folder of hierroom/; a room is a folder at any depth, or a file that is in no folder.
"""

import ast
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import networkx as nx

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "hierroom"


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def files() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


@cache
def file_imports() -> nx.DiGraph:
    """An arrow from each file to each file of the package that it imports, wherever in the file it does so."""
    modules = {module_of(path): path for path in files()}
    graph = nx.DiGraph()
    graph.add_nodes_from(modules.values())
    for name, path in modules.items():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("hierroom"):
                wanted = [f"{node.module}.{alias.name}" for alias in node.names]
                found = {modules.get(one, modules.get(node.module)) for one in wanted}
            elif isinstance(node, ast.Import):
                found = {modules.get(alias.name) for alias in node.names if alias.name.startswith("hierroom")}
            else:
                continue
            graph.add_edges_from((path, target) for target in found if target is not None and target != modules[name])
    graph.remove_node(PACKAGE / "__init__.py")  # the public names, loaded when they are asked for
    return graph


def part_of(path: Path) -> str:
    return path.relative_to(PACKAGE).with_suffix("").as_posix().split("/")[0]


def room_of(path: Path) -> str:
    folder = path.parent.relative_to(PACKAGE).as_posix()
    return path.stem if folder == "." else folder


@cache
def imports_between(place_of: Callable[[Path], str]) -> nx.DiGraph:
    """An arrow from each part, or room, to each one that it imports."""
    imports, graph = file_imports(), nx.DiGraph()
    graph.add_nodes_from(map(place_of, imports))
    arrows = ((place_of(source), place_of(target)) for source, target in imports.edges)
    graph.add_edges_from((source, target) for source, target in arrows if source != target)
    return graph


def drawing() -> str:
    """The rooms from the ground up, in Mermaid: each is one floor above the highest one that it imports.

    Rooms that import each other share a box. Arrows that others imply are left out.
    """
    graph = nx.condensation(imports_between(room_of))
    names = {box: ", ".join(sorted(graph.nodes[box]["members"])) for box in graph}
    ids = {box: re.sub(r"\W+", "_", name) for box, name in names.items()}
    lines = ["graph BT"]
    for floor, boxes in enumerate(nx.topological_generations(graph.reverse()), start=1):
        lines += [f"    subgraph f{floor} [{floor}]"]
        lines += [f'        {ids[box]}["{names[box]}"]' for box in sorted(boxes, key=ids.get)]
        lines += ["    end"]
    below: dict[frozenset, list[str]] = {}
    reduced = nx.transitive_reduction(graph)
    for box in sorted(reduced, key=ids.get):
        if targets := frozenset(map(ids.get, reduced[box])):
            below.setdefault(targets, []).append(ids[box])
    lines += [f"    {' & '.join(boxes)} --> {' & '.join(sorted(targets))}" for targets, boxes in below.items()]
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    print(drawing(), end="")
