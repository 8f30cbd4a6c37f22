"""The config of a run from a file: a TOML file of entries, or the config.json of a run, to repeat it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from hierroom.agents.config import AgentsConfig
from hierroom.learners.config import PPOConfig
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.presets import find_preset, implied_preset
from hierroom.runs.config.typed_value import entry_types, typed_value
from hierroom.support.errors import InputError
from hierroom.support.files import read_toml
from hierroom.worlds.env_config import EnvConfig

_META_PPO = "meta_ppo"
OF_ENVIRONMENTS = ("env_index", "levels")
"""Entries of an environment that a run sets itself: it trains in levels of its own, and is evaluated in others."""
_PARTS: Mapping[str, type] = {"env": EnvConfig, "agents": AgentsConfig, "ppo": PPOConfig}


def read_config(path: str | Path, *, trust: bool = False, **entries: Any) -> TrainConfig:
    """Read the config of a run from a file.

    A TOML file holds entries flat, named as on the command line with underscores (``num_envs = 32``), those of
    ``meta_ppo`` in a table of that name; ``"None"`` is none. What it does not name comes from its ``preset``. The
    ``config.json`` of a run holds every entry of that run, its goal graphs included. Other paths, such as that of a
    goal graph, are meant from the current folder.

    Args:
        path: the TOML file, which is the user's own word, or the ``config.json`` in the folder of a run, which is not.
        trust: whether to accept code that a ``config.json`` names besides what ships with hierroom, and that the
            entries do not name: a network, a reward or a meta-controller of somebody's own.
        **entries: entries that replace those of the file; a ``preset`` among them is what those of a TOML file start
            from.
    """
    path = Path(path)
    if path.name == "config.json":
        from hierroom.runs.folder.run_folder import RunFolder  # it brings torch along
        from hierroom.runs.folder.trust import require_trust

        config = RunFolder.open(path.parent).config().changed(**entries)
        require_trust(path.parent, config, trust=trust, named=entries)
        return config
    table = _read_entries(path)
    learner, preset = table.pop(_META_PPO, {}), table.pop("preset", None)
    preset = entries.pop("preset", None) or preset
    start = find_preset(preset or implied_preset(entries.get("meta", table.get("meta"))))
    place = f"{path}: "
    try:
        config = start.changed(**table)
        place += f"{_META_PPO}."
        config = config.changed(meta_ppo=replace(config.meta_ppo, **learner))
    except InputError as error:
        raise InputError(f"{place}{error}") from error
    return config.changed(**entries)


def _read_entries(path: Path) -> dict[str, Any]:
    """The entries of a TOML file, each of its type."""
    if path.is_dir():
        raise InputError(f"{path} is a folder; a config is a TOML file or, to repeat a run, its config.json")
    if path.suffix == ".json":
        raise InputError(f"{path}: the config of a run is read from its folder, where it is called config.json")
    table = read_toml(path, "config")
    types = flat_entry_types()
    for part in _PARTS.keys() & table.keys():
        raise InputError(f"{path}: entries stand alone, as on the command line; leave out the table [{part}]")
    return {name: _entry(path, name, value, types) for name, value in table.items()}


def flat_entry_types() -> dict[str, Any]:
    """The type that each entry of a run's config has in a file, by its name on the command line."""
    types = {name: kind for part in (*_PARTS.values(), TrainConfig) for name, kind in entry_types(part).items()}
    return {name: kind for name, kind in types.items() if name not in (*_PARTS, *OF_ENVIRONMENTS)}


def listed_entries(names: Iterable[str]) -> str:
    """Names of entries for a message; of those of ``meta_ppo``, which are the learner's again, only one."""
    plain = sorted(name for name in names if not name.startswith(f"{_META_PPO}."))
    return f"{', '.join(plain)}, and the learner's of {_META_PPO} too, such as {_META_PPO}.gamma"


def _entry(path: Path, name: str, value: Any, types: Mapping[str, Any], table: str = "") -> Any:
    """The value of an entry, which the file names and its table may hold."""
    if name not in types:
        near = get_close_matches(name.replace("-", "_"), types, n=1)
        known = f"is it {table}{near[0]}?" if near else f"there are {', '.join(sorted(types))}"
        raise InputError(f"{path}: there is no entry {table + name!r}; {known}")
    if not table and name == _META_PPO:
        if not isinstance(value, dict):
            raise InputError(f"{path}: {name} must be a table of entries, [{name}], not {value!r}")
        types = entry_types(PPOConfig)
        return {entry: _entry(path, entry, one, types, f"{name}.") for entry, one in value.items()}
    try:
        return typed_value(f"{table}{name}", types[name], value)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
