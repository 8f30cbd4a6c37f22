"""Trust in user-defined code: it runs if a call or command line names it, or the user trusts the run's folder."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hierroom.agents.config import DEFAULT_NETWORK
from hierroom.meta import LEARNED, META_CONTROLLERS
from hierroom.runs.config.config import TrainConfig
from hierroom.support.errors import InputError
from hierroom.turns.rewards import REWARDS
from hierroom.worlds.make import ships

COPIES = "modules"
"""The folder, inside a run's, with copies of the user's modules."""


def named_code(config: TrainConfig) -> dict[str, str]:
    """Return the ``meta``, ``network``, ``reward`` and ``task`` of a config, as far as they are not built-in names.

    They include entry points and functions of hierroom (``hierroom.train:main``), as all of these would be called.
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
    if unnamed:
        _find_copies(path if path.is_dir() else path.parent)


def _find_copies(run: Path) -> None:
    """Append a run's copies of modules to Python's path, the newest first."""
    copies = Path(run, COPIES).absolute()
    later = sorted(copies.glob("session-*"), key=lambda folder: (len(folder.name), folder.name), reverse=True)
    sys.path += [str(folder) for folder in (*later, copies) if folder.is_dir() and str(folder) not in sys.path]


def trust_option(config: TrainConfig) -> tuple[str, ...]:
    """Return the option that a command on a run of this config needs: ``--trust-run``, or none."""
    return ("--trust-run",) if named_code(config) else ()
