"""Imports the package with another source in the place of one module, and as much of it compiled as that allows."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from unittest.mock import patch

from numba.core import config

PACKAGE = Path(__file__).parents[2] / "hierroom"
COMPILED = {"hierroom.world.oracle"}
"""Modules whose kernels are given all that they need of others, so that these may change."""


class InMemory:
    """An entry of ``sys.meta_path`` that has Python import one module from a text instead of its file.

    That module and those that import it, over others too, run as ordinary Python, as their compiled code on disk
    contains the module as it is. All other kernels are compiled.

    Args:
        name: of the module, ``hierroom`` included.
        source: the text.
    """

    def __init__(self, name: str, source: str) -> None:
        self._name, self._source = name, source
        self._interpreted = importers(name, imports(PACKAGE)) - (COMPILED - {name})

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """As Python's import asks it."""
        if not fullname.startswith("hierroom."):
            return None
        spec = PathFinder.find_spec(fullname, path)  # pyright: ignore[reportArgumentType] - a package's __path__
        if spec is not None and spec.origin is not None:
            source = self._source if fullname == self._name else None
            spec.loader = _Loader(fullname, spec.origin, fullname in self._interpreted, source)
        return spec


class _Loader(SourceFileLoader):
    def __init__(self, name: str, path: str, is_interpreted: bool, source: str | None) -> None:
        super().__init__(name, path)
        self._is_interpreted, self._source = is_interpreted, source

    def get_code(self, fullname: str) -> CodeType | None:
        return super().get_code(fullname) if self._source is None else compile(self._source, self.path, "exec")

    def exec_module(self, module: ModuleType) -> None:
        with patch.object(config, "DISABLE_JIT", self._is_interpreted):  # what each kernel asks as it is defined
            super().exec_module(module)


def imports(package: Path) -> Mapping[str, set[str]]:
    """The modules of a package, each with the names that it imports, those in functions included.

    Args:
        package: its folder.
    """
    found: dict[str, set[str]] = {}
    for path in package.rglob("*.py"):
        module = ".".join(path.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__")
        found[module] = names = set[str]()
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                names.update(alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names.add(node.module)
                names.update(f"{node.module}.{alias.name}" for alias in node.names)
    return found


def importers(name: str, imported: Mapping[str, set[str]]) -> set[str]:
    """A module, those that import it, those that import these, and so on.

    Args:
        name: of the module.
        imported: what each module imports, as `imports` gives it.
    """
    found, new = set[str](), {name}
    while new:
        found |= new
        new = {module for module, names in imported.items() if names & new} - found
    return found
