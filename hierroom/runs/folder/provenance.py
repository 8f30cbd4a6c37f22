"""The origin of a run: provenance.json, with every command that worked on it, and copies of user-defined modules."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import torch

import hierroom
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.user_code import COPIES, ModuleFile, find_module_files, named_code
from hierroom.support.cli import shell_words
from hierroom.support.errors import InputError
from hierroom.support.files import read_json, read_text, to_json, write_atomically
from hierroom.support.output import warn

FILE = "provenance.json"
PACKAGES = ("numba", "numpy", "scipy", "torch", "gymnasium", "pettingzoo")
"""Packages, besides hierroom, with versions that can change results."""


def record_session(path: Path, config: TrainConfig, variant: str = "", warm_start: str = "") -> list[str]:
    """Add this session to a run's provenance.json, copy new and changed modules of the user, and return warnings.

    The copies are for reading; only `--trust-run` imports them. Environment variables and addresses of repositories are
    not written. ``variant`` is the run's name in the plan of a sweep; ``warm_start`` is the digest of the weights that
    it starts from.
    """
    sessions, files = read_sessions(path), find_module_files(config) if named_code(config) else []
    before = _newest_modules(path, sessions)
    warnings = _changes(path, files, before)
    warnings += [f"there is no copy of {file.name} in {path}: {file.problem}" for file in files if file.problem]
    folder = COPIES if len(sessions) == 0 else f"{COPIES}/session-{len(sessions) + 1}"
    modules = [_copied(path, folder, file, before.get(file.name)) for file in files]
    called: dict[str, Any] = {"variant": variant} if variant else {}
    called |= {"warm_start": {"file": config.warm_start, "sha256": warm_start}} if warm_start else {}
    package = Path(hierroom.__file__).parent
    session = {
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": shell_words(*sys.orig_argv),
        "folder": str(Path.cwd()),
        "git": describe_git(Path.cwd()),
        "hierroom": {"version": hierroom.__version__, "git": describe_git(package, "__init__.py")},
        "python": platform.python_version(),
        "packages": {name: version(name) for name in PACKAGES},
        "platform": platform.platform(),
        "cpu": cpu_name(),
        "cores": os.cpu_count(),
        "gpu": torch.cuda.get_device_name(config.device) if config.device.startswith("cuda") else None,
    }
    sessions.append({**called, **session, "modules": modules})
    write_atomically(path / FILE, to_json({"sessions": sessions}))
    return warnings


def variant_of(path: Path) -> str:
    """Return the run's variant in a sweep's plan; empty if it has none."""
    named = (one for one in read_sessions(path) if isinstance(one, dict))
    return next((str(one["variant"]) for one in named if "variant" in one), "")


def code_of(path: Path) -> dict[str, frozenset[str]]:
    """Return the code of a run by name: modules, hierroom, packages, and the weights of its warm start.

    The values are digests and versions, several if the sessions differ. Empty if provenance.json cannot be read.
    """
    found: dict[str, set[str]] = {}
    try:
        for session in read_sessions(path):
            values = session["packages"] | {one["file"]: one["sha256"] for one in session["modules"]}
            if "warm_start" in session:
                values[f"the weights of {session['warm_start']['file']}"] = session["warm_start"]["sha256"]
            values["hierroom"] = _with_commit(session["hierroom"]["version"], session["hierroom"]["git"])
            for name, value in values.items():
                if value is not None:
                    found.setdefault(str(name), set()).add(str(value))
    except (InputError, TypeError, KeyError, AttributeError):  # it was edited by hand
        return {}
    return {name: frozenset(values) for name, values in found.items()}


def changed_modules(path: Path, config: TrainConfig) -> list[str]:
    """Return a line for each user-defined module that has changed since the run in the folder was trained."""
    before = _newest_modules(path, read_sessions(path))
    return _changes(path, find_module_files(config), before) if before else []


def warn_of_changed_modules(path: Path, config: TrainConfig) -> None:
    """Print a warning for each user-defined module that has changed; see `changed_modules`."""
    for line in changed_modules(path, config):
        warn(line)


@contextmanager
def misfits_explained(path: Path, config: TrainConfig, prefix: str) -> Iterator[None]:
    """Add a prefix to the message of an error, and the user's modules that have changed, as they may be its cause."""
    try:
        yield
    except InputError as error:
        changes = []
        with suppress(InputError):  # provenance.json cannot be read
            changes = changed_modules(path, config)
        raise InputError("; ".join([f"{prefix}: {error}", *changes])) from error


@cache
def version_of_code() -> str:
    """Return the version of hierroom; in a git checkout, with the commit at the first call."""
    return _with_commit(hierroom.__version__, describe_git(Path(hierroom.__file__).parent, "__init__.py"))


def _with_commit(version: str, git: Mapping[str, Any] | None) -> str:
    if git is None:
        return version
    return f"{version.partition('+')[0]}+g{git['commit'][:9]}{'.dirty' if git['is_dirty'] else ''}"


def describe_git(folder: Path, tracked: str | None = None) -> dict[str, Any] | None:
    """Return the commit that is checked out in a folder, and whether tracked files differ; None if there is none.

    Run no program that the checkout's config names, such as a filter, hook, monitor or fetcher. The checkout must track
    the folder's file ``tracked``, because an installed package may be inside another project's checkout.
    """
    if tracked is not None and _git(folder, "ls-files", "--error-unmatch", tracked) is None:
        return None
    listed = [
        _git(folder, "config", scope, "--includes", "--null", "--name-only", "--get-regexp", r"^filter\.")
        for scope in ("--local", "--worktree")
    ]
    names = {key.rpartition(".")[0] for keys in listed if keys for key in keys.strip("\0").split("\0")}
    if any("=" in name for name in names):  # -c would read the rest of the name as the value
        return None
    off = [f"{name}.{entry}" for name in sorted(names) for entry in ("clean=", "process=", "required=false")]
    config = [word for entry in off for word in ("-c", entry)]
    # A submodule has its own config with filters, so git status must not look for changes in it.
    how = "--porcelain", "--untracked-files=no", "--ignore-submodules=dirty"
    commit, status = _git(folder, "rev-parse", "HEAD"), _git(folder, *config, "status", *how)
    return None if commit is None or status is None else {"commit": commit, "is_dirty": bool(status)}


def _git(folder: Path, *arguments: str) -> str | None:
    # In a git hook, GIT_ variables name another repository and would override the folder. Missing files are not
    # fetched, because the checkout's config names the program that fetches.
    env = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    env["GIT_NO_LAZY_FETCH"] = "1"
    command = ["git", "--no-optional-locks", "-c", "core.fsmonitor=false", *arguments]
    try:
        done = subprocess.run(
            command, cwd=folder, env=env, capture_output=True, encoding="utf-8", timeout=10, check=True
        )
    except (OSError, subprocess.SubprocessError, UnicodeDecodeError):
        return None
    return done.stdout.strip()


def cpu_name() -> str:
    """Return the name of this machine's processor, or its kind if the system does not say."""
    try:
        lines = read_text(Path("/proc/cpuinfo")).splitlines()
    except InputError:
        lines = []
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.processor() or platform.machine()


def read_sessions(path: Path) -> list[dict[str, Any]]:
    """Return the sessions of a run's provenance.json, unchanged; none if there is no such file."""
    file = path / FILE
    if not file.exists():
        return []
    table = read_json(file)
    if not isinstance(table, dict) or not isinstance(sessions := table.get("sessions"), list):
        raise InputError(f"cannot read {file}: it lists no sessions")
    return sessions


def _newest_modules(path: Path, sessions: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    try:
        return {str(one["file"]): {"sha256": None, **one} for one in sessions[-1]["modules"]} if sessions else {}
    except (KeyError, TypeError) as error:
        raise InputError(f"{path / FILE} is broken: a session lists no modules") from error


def _changes(path: Path, files: list[ModuleFile], before: dict[str, dict[str, Any]]) -> list[str]:
    lines = []
    for file in files if before else []:
        old = before.get(file.name)
        if old is None:
            lines.append(f"{file.name} is used now, and was not when {path} was trained")
        elif old["sha256"] != file.digest:
            was = f"what it was is {old['copy']}" if "copy" in old else f"its digest then is in {FILE}"
            lines.append(f"{file.name} has changed since {path} was trained: {was} there")
    return lines


def _copied(path: Path, folder: str, file: ModuleFile, before: Mapping[str, Any] | None) -> dict[str, Any]:
    record = {"file": file.name, "sha256": file.digest}
    if file.problem or file.content is None:
        return {**record, "problem": file.problem}
    if before is not None and before["sha256"] == file.digest and "copy" in before:
        return {**record, "copy": before["copy"]}
    copy = f"{folder}/{file.name}"
    (path / copy).parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path / copy, file.content)
    return {**record, "copy": copy}
