"""Imports the package with another source for one module; modules that do not import it stay compiled."""

from __future__ import annotations

from functools import cache
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from unittest.mock import patch

import networkx as nx
from numba.core import config

from ..architecture import PACKAGE, file_imports

COMPILED = {PACKAGE / "worlds" / "escape_room" / "oracle.py"}
"""Files whose kernels are given all that they need of others, so that these may change."""


class InMemory:
    """An entry of ``sys.meta_path`` that has Python import one module from a text instead of its file.

    That module and those that import it, over others too, run as ordinary Python, as their compiled code on disk
    contains the module as it is. All other kernels are compiled.
    """

    def __init__(self, path: Path, source: str) -> None:
        self._path, self._source, self._interpreted = path, source, interpreted(path)

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Return the spec of a module for Python's import."""
        if not fullname.startswith("hierroom."):
            return None
        spec = PathFinder.find_spec(fullname, path)  # pyright: ignore[reportArgumentType] - a package's __path__
        if spec is not None and spec.origin is not None:
            file = Path(spec.origin)
            source = self._source if file == self._path else None
            spec.loader = _Loader(fullname, spec.origin, file in self._interpreted, source)
        return spec


class _Loader(SourceFileLoader):
    def __init__(self, name: str, path: str, is_interpreted: bool, source: str | None) -> None:
        super().__init__(name, path)
        self._is_interpreted, self._source = is_interpreted, source

    def get_code(self, fullname: str) -> CodeType | None:
        return super().get_code(fullname) if self._source is None else compile(self._source, self.path, "exec")

    def exec_module(self, module: ModuleType) -> None:
        with patch.object(config, "DISABLE_JIT", self._is_interpreted):  # each kernel reads it as it is defined
            super().exec_module(module)


@cache
def interpreted(path: Path) -> frozenset[Path]:
    """The file and all files that import it, directly or through others, except `COMPILED`."""
    return frozenset({path, *(nx.ancestors(file_imports(), path) - COMPILED)})
