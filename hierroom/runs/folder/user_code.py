"""User-defined code: trust in it, and its source files, found and compared by digest, never imported."""

from __future__ import annotations

import ast
import hashlib
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec, resolve_name
from pathlib import Path
from typing import Any

from hierroom.agents.config import DEFAULT_NETWORK
from hierroom.meta import LEARNED, META_CONTROLLERS
from hierroom.runs.config.config import TrainConfig
from hierroom.support.errors import InputError
from hierroom.support.files import read_bytes
from hierroom.turns.rewards import REWARDS
from hierroom.worlds.make import ships

COPIES = "modules"
"""The folder, inside a run's, with copies of the user's modules."""


def named_code(config: TrainConfig) -> dict[str, str]:
    """Return the ``meta``, ``network``, ``reward`` and ``task`` of a config, as far as they are not built-in names.

    They include functions of hierroom (``hierroom.train:main``), as these would be called, too.
    Nothing is imported.
    """
    shipped = {"meta": (*META_CONTROLLERS, LEARNED), "network": (DEFAULT_NETWORK,), "reward": REWARDS}
    found = {what: config.entries[what] for what in shipped if config.entries[what] not in (None, *shipped[what])}
    return found if config.env.task is None or ships(config.env.task) else {**found, "task": config.env.task}


def require_trust(path: Path, config: TrainConfig, *, trust: bool, named: Mapping[str, Any] | None = None) -> None:
    """Refuse a folder's config that names other code than the user has ``named``, unless the user trusts the folder.

    Modules of a trusted folder are imported from Python's path, or else from the copies in the run's folder.
    """
    given = named or {}
    unnamed = {what: spec for what, spec in named_code(config).items() if given.get(what) != spec}
    if unnamed and not trust:
        names = ", ".join(f"{what} {spec!r}" for what, spec in unnamed.items())
        raise InputError(
            f"{path} names code that does not ship with hierroom: {names}; it is run only if you trust it: "
            "--trust-run, or trust=True in Python"
        )
    if unnamed:  # Python's path gets the run's copies of modules, the newest first
        copies = Path(path if path.is_dir() else path.parent, COPIES).absolute()
        later = sorted(copies.glob("session-*"), key=lambda folder: (len(folder.name), folder.name), reverse=True)
        sys.path += [str(folder) for folder in (*later, copies) if folder.is_dir() and str(folder) not in sys.path]


def trust_option(config: TrainConfig) -> tuple[str, ...]:
    """Return the option that a command on a run of this config needs: ``--trust-run``, or none."""
    return ("--trust-run",) if named_code(config) else ()


MAX_FILES, MAX_BYTES = 50, 2**20
_MORE = "..."


@dataclass(frozen=True)
class ModuleFile:
    """A source file that a run uses."""

    name: str  # its path, relative to the folder from which its module is imported, such as ``lab/metas.py``
    content: bytes | None  # None if it cannot be read
    problem: str = ""  # why it is not copied

    @property
    def digest(self) -> str | None:
        """The SHA-256 of the content, in hexadecimal; None if it cannot be read."""
        return None if self.content is None else hashlib.sha256(self.content).hexdigest()


def find_module_files(config: TrainConfig, metas: Sequence[str] = ()) -> list[ModuleFile]:
    """Return the files of the modules that a config and ``metas`` name, and of their imports from the same folder.

    Imports are read from the source; nothing is imported here. An installed package contributes only its own files, and
    files of hierroom are never included. At most 50 are returned, and one named ``...`` if there are more.
    """
    files: dict[str, ModuleFile] = {}
    named = [*named_code(config).values(), *metas]
    specs = [spec.partition(":") for spec in named if isinstance(spec, str)]
    modules = [module for module, colon, _ in specs if colon and module.partition(".")[0] != "hierroom"]
    for module in dict.fromkeys(filter(None, modules)):
        path = _file_of(module)
        if path is None or Path(path).suffix != ".py":
            files.setdefault(module, ModuleFile(module, None, "it has no Python source"))
            continue
        path = Path(path).absolute()
        root = path.parents[min(module.count(".") + (path.name == "__init__.py"), len(path.parents) - 1)]
        if _source(root, module) is None:  # such as __main__, which has another name
            files[path.name] = _read(path, path.name)
        else:
            _gather(module, root, files)
    return [files[name] for name in sorted(files)]


def user_code_digest(config: TrainConfig, metas: Sequence[str] = ()) -> str:
    """Return a digest of `find_module_files`, 16 hexadecimal digits; empty if there are none or one is unreadable."""
    files = [(file.name, file.digest) for file in find_module_files(config, metas) if file.name != _MORE]
    is_complete = files and all(digest for _, digest in files)
    return hashlib.sha256(repr(files).encode()).hexdigest()[:16] if is_complete else ""


def _file_of(module: str) -> str | Path | None:
    if module in sys.modules:
        return getattr(sys.modules[module], "__file__", None)
    found = (_source(Path(folder), module) for folder in (Path.cwd(), *sys.path, *_folders_of_finders(module)))
    return next(filter(None, found), None)


def _folders_of_finders(module: str) -> Iterator[Path]:
    """Yield the folders where Python's finders, such as those of editable installs, find a module's top package."""
    try:
        spec = find_spec(module.partition(".")[0])
    except (ImportError, ValueError):  # a finder fails, or a loaded module has no spec
        return
    if spec is not None:
        packages = spec.submodule_search_locations or ([] if spec.origin is None else [spec.origin])
        yield from (Path(place).parent for place in packages)


def _gather(first: str, root: Path, files: dict[str, ModuleFile]) -> None:
    is_installed = not {"site-packages", "dist-packages"}.isdisjoint(root.parts)
    waiting, seen = [first], set()
    while waiting:
        module = waiting.pop()
        top = module.partition(".")[0]
        path = _source(root, module)
        if path in seen or path is None or top == "hierroom" or (is_installed and top != first.partition(".")[0]):
            continue
        seen.add(path)
        if len(files) >= MAX_FILES:
            files[_MORE] = ModuleFile(_MORE, None, f"these and others are more than {MAX_FILES} files")
            return
        file = _read(path, path.relative_to(root).as_posix())
        files[file.name] = file
        waiting += _imports(file, module if path.name == "__init__.py" else module.rpartition(".")[0])


def _source(root: Path, module: str) -> Path | None:
    """Return the file of a module below a folder, unless a module of that name was loaded from another file."""
    base = root.joinpath(*module.split("."))
    for path in (base / "__init__.py", base.with_name(f"{base.name}.py")):
        if path.is_file():
            loaded = getattr(sys.modules.get(module), "__file__", None)
            return path if loaded is None or Path(loaded).resolve() == path.resolve() else None
    return None


def _read(path: Path, name: str) -> ModuleFile:
    try:
        content = read_bytes(path)
    except InputError as error:
        return ModuleFile(name, None, f"it cannot be read: {str(error).rpartition(': ')[2]}")
    too_large = f"it is larger than {MAX_BYTES // 1024} KiB" if len(content) > MAX_BYTES else ""
    return ModuleFile(name, content, too_large)


def _imports(file: ModuleFile, package: str) -> Iterator[str]:
    try:
        nodes = [*ast.walk(ast.parse(file.content or b""))]
    except (SyntaxError, ValueError, RecursionError):  # its source has changed since it was loaded
        return
    names = [package, *(alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names)]
    for node in nodes:
        if isinstance(node, ast.ImportFrom):
            base = "." * node.level + (node.module or "")
            if node.level and package:
                try:
                    base = resolve_name(base, package)
                except ImportError:  # relative beyond the top package; the file may catch it
                    continue
            names += [base, *(f"{base}.{alias.name}" for alias in node.names)]
    for name in names:
        parts = [part for part in name.split(".") if part.isidentifier()]
        yield from (".".join(parts[:end]) for end in range(1, len(parts) + 1))
