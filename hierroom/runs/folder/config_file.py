"""Read the config of a run from a file: a TOML file of entries, or the config.json of a run, to repeat it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from hierroom.runs.config.config import ENTRIES, META_PART, OF_META, PARTS, TrainConfig
from hierroom.runs.config.presets import start_config
from hierroom.support.errors import InputError, shown, warn_once
from hierroom.support.files import read_toml, usable_path
from hierroom.support.typed_value import entry_types, typed_value

OF_ENVIRONMENTS = ("env_index", "levels")
"""Entries of an environment that a run sets itself, as training and evaluation have different levels."""


def read_config(path: str | Path, *, trust: bool = False, **entries: Any) -> TrainConfig:
    """Read the config of a run from a file.

    A TOML file has entries named as on the command line, with underscores (``num_envs = 32``); those of ``meta_ppo``
    are in a table of that name. ``"None"`` means None. Its ``preset`` gives the other entries. The ``config.json`` of a
    run has every entry. Paths in a file are relative to the current folder.

    Args:
        path: a TOML file, which is trusted, or the ``config.json`` of a run, which is not.
        trust: whether to accept user-defined code that a ``config.json`` names and the entries do not.
        **entries: entries that replace those of the file; they may include the ``preset`` of a TOML file.
    """
    path = Path(path)
    if path.name == "config.json":
        from hierroom.runs.folder.run_folder import RunFolder  # it imports torch
        from hierroom.runs.folder.user_code import require_trust

        config = RunFolder.open(path.parent).config().changed(**entries)
        require_trust(path.parent, config, trust=trust, named=entries)
        return config
    table = _read_entries(path)
    preset = entries.pop("preset", None) or table.pop("preset", None)
    table.pop("preset", None)
    try:
        start = start_config(preset, {**table, **entries})
        task = {"task": entries.pop("task")} if "task" in entries else {}  # it decides what the file's entries mean
        config = start.changed(**table | task)
        config.env.refuse_unread(table)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    return config.changed(**entries)


def _read_entries(path: Path) -> dict[str, Any]:
    if usable_path(path).is_dir():
        raise InputError(f"{path} is a folder; a config is a TOML file or, to repeat a run, its config.json")
    if path.suffix == ".json":
        raise InputError(f"{path}: the config of a run is read from its folder, where it is called config.json")
    table, types = read_toml(path, "config", or_any=True), flat_entry_types()
    if not table:
        warn_once(f"{path} has no entries, such as steps = 200_000")
    for part in PARTS.keys() & table.keys() - {META_PART}:
        raise InputError(f"{path}: entries stand alone, as on the command line; leave out the table [{part}]")
    entries = flat_entries(table, f"{path}: ")
    for name in entries:
        if name not in types:
            raise InputError(f"{path}: there is no entry {name!r}; {hint_of(name.replace('-', '_'), types)}")
    return {name: typed_value(f"{path}: {name}", types[name], value) for name, value in entries.items()}


def flat_entry_types() -> dict[str, Any]:
    """Return the type of each entry that a file may hold, by its flat name."""
    types = {part: entry_types(kind) for part, kind in {**PARTS, "": TrainConfig}.items()}
    return {name: types[part][field] for name, (part, field) in ENTRIES.items() if name not in OF_ENVIRONMENTS}


def flat_entries(table: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return the entries of a TOML file by their flat names; ``where`` begins a message."""
    learner = table.get(META_PART, {})
    if not isinstance(learner, dict):
        raise InputError(f"{where}{META_PART} must be a table of entries, [{META_PART}], not {shown(learner)}")
    plain = {name: value for name, value in table.items() if name != META_PART}
    return plain | {f"{OF_META}{name}": value for name, value in learner.items()}


def hint_of(name: str, names: Collection[str]) -> str:
    """Return the known name that an unknown one is most like, as a question; if it is like none, all of them.

    Of ``meta_ppo`` there is one example, as it repeats the names of ``ppo``.
    """
    if near := get_close_matches(name, names, n=1):
        return f"is it {near[0]}?"
    plain = sorted(one for one in names if not one.startswith(OF_META))
    return f"there are {', '.join(plain)}, and the learner's of {META_PART} too, such as {OF_META}gamma"
