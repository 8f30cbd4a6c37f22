"""The sweeps in `benchmarks/sweeps/` and their rows in `benchmarks/results/`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd

from hierroom.lab.sweep.plan import Plan, PlannedRun, read_plan
from hierroom.lab.sweep.table import SweepTable
from hierroom.support.errors import InputError

ROOT = Path(__file__).parents[1]


def plan_of(name: str) -> Plan:
    """Return the plan of a sweep.

    Raises:
        InputError: if there is no such sweep.
    """
    return read_plan(ROOT / "benchmarks" / "sweeps" / f"{name}.toml")


def done_rows(name: str, runs: Sequence[PlannedRun]) -> pd.DataFrame:
    """Return the rows of a sweep's runs.

    Raises:
        InputError: if one is not done.
    """
    rows = SweepTable(ROOT / "benchmarks" / "results" / name).of(runs)
    if len(rows) < len(runs):
        raise InputError(
            f"{len(rows)} of {len(runs)} runs of the sweep {name} are done; "
            "a page shows a sweep only when all its runs are done"
        )
    return rows


def checked_path(name: str, n_seeds: str) -> Path:
    """Return the path of the table of a sweep, from the root of the repository; its runs of the first seeds are done.

    Args:
        name: of the sweep.
        n_seeds: how many seeds, a whole number.

    Raises:
        InputError: if a run of them is not done.
    """
    done_rows(name, replace(plan_of(name), seeds=int(n_seeds)).runs())
    return Path("benchmarks", "results", name, "sweep.csv")
