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
from hierroom.support.errors import InputError, shown
from hierroom.support.files import read_toml
from hierroom.worlds.env_config import EnvConfig

_META_PPO, _OF_META = "meta_ppo", "meta_ppo."
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
    preset = entries.pop("preset", None) or table.pop("preset", None)
    table.pop("preset", None)
    try:
        start = find_preset(preset or implied_preset(entries.get("meta", table.get("meta"))))
        learner = {name.removeprefix(_OF_META): table.pop(name) for name in [*table] if name.startswith(_OF_META)}
        config = start.changed(**table)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    try:
        config = config.changed(meta_ppo=replace(config.meta_ppo, **learner))
    except InputError as error:
        raise InputError(f"{path}: {_OF_META}{error}") from error
    return config.changed(**entries)


def _read_entries(path: Path) -> dict[str, Any]:
    """The entries of a TOML file, each of its type; those of ``meta_ppo`` as ``meta_ppo.gamma``."""
    if path.is_dir():
        raise InputError(f"{path} is a folder; a config is a TOML file or, to repeat a run, its config.json")
    if path.suffix == ".json":
        raise InputError(f"{path}: the config of a run is read from its folder, where it is called config.json")
    table, types = read_toml(path, "config"), flat_entry_types()
    for part in _PARTS.keys() & table.keys():
        raise InputError(f"{path}: entries stand alone, as on the command line; leave out the table [{part}]")
    entries = flat_entries(table, f"{path}: ")
    for name in entries:
        if name not in types:
            near = get_close_matches(name.replace("-", "_"), types, n=1)
            known = f"is it {near[0]}?" if near else f"there are {listed_entries(types)}"
            raise InputError(f"{path}: there is no entry {name!r}; {known}")
    return {name: typed_value(f"{path}: {name}", types[name], value) for name, value in entries.items()}


def flat_entry_types() -> dict[str, Any]:
    """Return the type of each entry in a file, by its name on the command line; those of ``meta_ppo`` dotted."""
    types = {name: kind for part in (*_PARTS.values(), TrainConfig) for name, kind in entry_types(part).items()}
    plain = {name: kind for name, kind in types.items() if name not in (*_PARTS, _META_PPO, *OF_ENVIRONMENTS)}
    return plain | {f"{_OF_META}{name}": kind for name, kind in entry_types(PPOConfig).items()}


def flat_entries(table: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return the entries of a file with those of ``meta_ppo`` dotted.

    Args:
        table: what the file holds.
        where: the file, for the message.
    """
    learner = table.get(_META_PPO, {})
    if not isinstance(learner, dict):
        raise InputError(f"{where}{_META_PPO} must be a table of entries, [{_META_PPO}], not {shown(learner)}")
    plain = {name: value for name, value in table.items() if name != _META_PPO}
    return plain | {f"{_OF_META}{name}": value for name, value in learner.items()}


def listed_entries(names: Iterable[str]) -> str:
    """Return names of entries for a message; of those of ``meta_ppo``, which are the learner's again, only one."""
    plain = sorted(name for name in names if not name.startswith(_OF_META))
    return f"{', '.join(plain)}, and the learner's of {_META_PPO} too, such as {_OF_META}gamma"
