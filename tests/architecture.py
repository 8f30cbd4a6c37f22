"""The structure of the package, read from its imports: parts (files and folders of hierroom/) and their imports."""

import ast
from pathlib import Path

import networkx as nx

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "hierroom"


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def files() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


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


def part_imports() -> nx.DiGraph:
    """An arrow from each part to each part that it imports."""
    imports, graph = file_imports(), nx.DiGraph()
    graph.add_nodes_from(map(part_of, imports))
    arrows = ((part_of(source), part_of(target)) for source, target in imports.edges)
    graph.add_edges_from((source, target) for source, target in arrows if source != target)
    return graph


def floors() -> list[list[str]]:
    """The parts from the ground up: each stands one floor above the highest part that it imports."""
    return [sorted(parts) for parts in nx.topological_generations(part_imports().reverse())]
