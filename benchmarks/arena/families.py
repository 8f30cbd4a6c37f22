"""The families of the arena: where their tasks are, how long a run is, and what has to be installed."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np

from hierroom.support.errors import InputError


@dataclass(frozen=True)
class Family:
    """Worlds of one engine.

    Args:
        name: of its module in `benchmarks.arena`, whose ``TASKS`` are tasks, or entries of `EnvConfig`, by name.
        steps: the budget: primitive steps of a run, so that it takes about five minutes of one core.
        play_steps: of random play before it, for about 30 seconds of one core: steps, so that no clock decides.
        packages: that it imports.
        install: the arguments of ``pip install`` that install them.
    """

    name: str
    steps: int
    play_steps: int
    packages: tuple[str, ...] = ()
    install: str = ""

    @property
    def is_ours(self) -> bool:
        """Whether its worlds are in the package."""
        return self.name in ("escape_room", "workshop")

    @property
    def is_installed(self) -> bool:
        """Whether its packages are there."""
        return all(find_spec(package) is not None for package in self.packages)

    def tasks(self) -> Mapping[str, Mapping[str, Any]]:
        """Return for each task, by name, the entries of `EnvConfig` that describe it."""
        if not self.is_installed:
            raise InputError(f"{self.name} is not installed:  pip install {self.install}")
        module = f"{__package__}.{self.name}"
        tasks = importlib.import_module(module).TASKS
        return {name: one if isinstance(one, dict) else {"task": f"{module}:{name}"} for name, one in tasks.items()}


_ALL = (
    Family("crafter_symbols", 150_000, 40_000, ("crafter", "numba"), "crafter numba"),
    Family("escape_room", 1_000_000, 1_000_000),
    Family("hierarchycraft", 100_000, 40_000, ("hcraft",), "hcraft"),
    Family("minigrid_levels", 200_000, 20_000, ("minigrid",), "minigrid"),
    Family(
        name="minihack_rooms",
        steps=200_000,
        play_steps=15_000,
        packages=("nle", "minihack", "pkg_resources"),
        install="--no-deps nle minihack 'setuptools<82'",
    ),
    Family("point_maze", 300_000, 300_000, ("gymnasium_robotics",), "gymnasium-robotics"),
    Family("toy_text", 300_000, 600_000),
    Family("workshop", 1_000_000, 1_000_000),
)
_ADDED = Family("hierarchycraft_unmasked", 300_000, 100_000, ("hcraft",), "hcraft")
"""Added after the runs of hierarchycraft, in which nothing was left to learn."""
ORDER_SEED = 73
"""Written before any prediction; `FAMILIES` is in the order that it draws, before what was added."""
_ORDER = np.random.default_rng(ORDER_SEED).permutation(len(_ALL))
FAMILIES: Mapping[str, Family] = {one.name: one for one in (*(_ALL[n] for n in _ORDER), _ADDED)}


def find_families(names: list[str]) -> list[Family]:
    """Return families by name, in their order; without names those that are installed."""
    if unknown := {*names} - {*FAMILIES}:
        raise InputError(f"the families are {', '.join(FAMILIES)}; not {', '.join(sorted(unknown))}")
    return [one for name, one in FAMILIES.items() if (name in names if names else one.is_installed)]
