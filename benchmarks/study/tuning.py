"""Choose the settings of each method: those with the largest area under the learning curve.

    python -m benchmarks.study.tuning TABLE.csv ...

Each TABLE.csv is a table of training runs as `python -m hierroom sweep` writes it, every setting of a method on the
same goal graphs. A setting's area is the mean over its runs of `area_under_curve`, 0 to 1. A value that all runs of
a method have in common is not shown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import tyro

from benchmarks.study.tables import Row, read_rows
from hierroom.support.cli import run
from hierroom.support.errors import InputError
from hierroom.support.tables import markdown_table

TUNED = (
    *("learning_rate", "novelty_bonus", "curiosity_weight", "gamma"),
    *("minibatches", "value_weight", "entropy_weight"),
)
"""Columns of the tables that may be tuned."""
NEEDED = ("method", "graph", "seed", "area_under_curve")
HEADER = ("method", "settings", "largest area with", "area", "of each run", "area of the other settings")
Setting = tuple[tuple[str, float], ...]
"""A value for each name of `TUNED` that a method was tuned in."""


@dataclass(frozen=True)
class Options:
    """Compare the settings of each method.

    Args:
        tables: the training runs.
    """

    tables: tyro.conf.Positional[tuple[Path, ...]]


@dataclass(frozen=True)
class Tuned:
    """The settings of one method.

    Args:
        method: its name.
        areas: of each setting, the area of each of its runs, which are of the same graphs and seeds, 0 to 1.
    """

    method: str
    areas: dict[Setting, tuple[float, ...]]

    @property
    def best(self) -> Setting | None:
        """The setting with the largest mean area, the first of several; None if no setting learns anything."""
        best = max(self.areas, key=self.area)
        return best if self.area(best) > 0 else None

    def area(self, setting: Setting) -> float:
        """Return the mean area of a setting over its runs."""
        return sum(self.areas[setting]) / len(self.areas[setting])


def tuned(rows: Sequence[Row]) -> list[Tuned]:
    """Return the settings of each method of a table, in its order.

    Args:
        rows: of the table.

    Raises:
        InputError: if there are no rows, or they are not of a table of training runs, a method has a single setting, or
            settings were not trained on the same graphs with the same seeds.
    """
    if not rows:
        raise InputError("there are no training runs to compare; give a table of them")
    of_methods: dict[str, list[Row]] = {}
    for row in rows:
        if missing := [name for name in NEEDED if not row.get(name)]:
            raise InputError(f"each row of a table of training runs needs a {missing[0]}")
        of_methods.setdefault(row["method"], []).append(row)
    return [_tuned(method, own) for method, own in of_methods.items()]


def _tuned(method: str, rows: Sequence[Row]) -> Tuned:
    numbers = [_numbers(row) for row in rows]
    if len({frozenset(one) for one in numbers}) > 1:
        raise InputError(f"the runs of {method} do not all have the same columns of {', '.join(TUNED)}")
    varied = [name for name in TUNED if len({one.get(name) for one in numbers}) > 1]
    runs: dict[Setting, dict[tuple[str, str], float]] = {}
    for row, one in zip(rows, numbers, strict=True):
        areas = runs.setdefault(tuple((name, one[name]) for name in varied), {})
        if (run := (row["graph"], row["seed"])) in areas:
            raise InputError(f"{method} was trained twice on {run[0]} with seed {run[1]} and the same settings")
        areas[run] = one["area_under_curve"]
    if len(runs) < 2:
        raise InputError(f"{method} was trained with one setting; none of {', '.join(TUNED)} differs between its runs")
    if len({frozenset(of_runs) for of_runs in runs.values()}) > 1:
        raise InputError(f"the settings of {method} were not all trained on the same graphs with the same seeds")
    return Tuned(method, {setting: tuple(of_runs.values()) for setting, of_runs in runs.items()})


def _numbers(row: Row) -> dict[str, float]:
    """Return the settings that a run was tuned in, and its area."""
    try:
        return {name: float(row[name]) for name in (*TUNED, "area_under_curve") if row.get(name)}
    except ValueError as error:
        raise InputError(f"a run of {row['method']} on {row['graph']} needs a number: {error}") from error


def markdown(found: Sequence[Tuned]) -> str:
    """Return a row for each method."""
    return markdown_table(HEADER, [_cells(one) for one in found])


def _cells(one: Tuned) -> list[str]:
    best = one.best
    if best is None:
        return [one.method, str(len(one.areas)), "-", *["0"] * 3]
    others = [one.area(setting) for setting in one.areas if setting != best]
    words = ", ".join(f"{name} {value:g}" for name, value in best)
    spreads = (f"{_area(min(several))} to {_area(max(several))}" for several in (one.areas[best], others))
    return [one.method, str(len(one.areas)), words, _area(one.area(best)), *spreads]


def _area(value: float) -> str:
    return f"{value:.2f}" if value >= 0.01 else f"{value:.4f}" if value >= 5e-5 else "0"


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    print(markdown(tuned([row for path in options.tables for row in read_rows(path)])))
    return 0


if __name__ == "__main__":
    run(main)
