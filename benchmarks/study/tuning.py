"""Which settings were tuned for each method? Those with the largest area under the learning curve.

    python -m benchmarks.study.tuning TABLE.csv ...

Each TABLE.csv is a table of training runs as `python -m hierroom.sweep` writes it, every setting of a method on the
same goal graphs. A setting's area is the mean over these graphs of `area_under_curve`, 0 to 1. A value that all runs of
a method have in common is not shown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import tyro

from benchmarks.study.factors import table
from benchmarks.study.tables import Row, read_rows
from hierroom.cli import run
from hierroom.errors import InputError

SETTINGS = ("learning_rate", "novelty_bonus", "curiosity_weight", "gamma")
"""What may be tuned, columns of the tables."""
NEEDED = ("method", "graph", "seed", "area_under_curve")
HEADER = ("method", "settings", "largest area with", "area", "on each graph", "area of the other settings")
Setting = tuple[tuple[str, float], ...]
"""A value for each name of `SETTINGS` that a method was tuned in."""


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
        areas: of each setting, the area on each graph, 0 to 1.
    """

    method: str
    areas: dict[Setting, tuple[float, ...]]

    @property
    def best(self) -> Setting | None:
        """The setting with the largest mean area, the first of several; None if no setting learns anything."""
        best = max(self.areas, key=self.area)
        return best if self.area(best) > 0 else None

    def area(self, setting: Setting) -> float:
        """The mean area of a setting over the graphs."""
        return sum(self.areas[setting]) / len(self.areas[setting])


def tuned(rows: Sequence[Row]) -> list[Tuned]:
    """The settings of each method of a table, in its order.

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
    varied = [name for name in SETTINGS if len({row[name] for row in rows if name in row}) > 1]
    runs: dict[Setting, dict[tuple[str, str], float]] = {}
    for row in rows:
        setting = tuple((name, float(row[name])) for name in varied)
        runs.setdefault(setting, {})[row["graph"], row["seed"]] = float(row["area_under_curve"])
    if len(runs) < 2:
        raise InputError(
            f"{method} was trained with one setting; none of {', '.join(SETTINGS)} differs between its runs"
        )
    if len({frozenset(of) for of in runs.values()}) > 1:
        raise InputError(f"the settings of {method} were not all trained on the same graphs with the same seeds")
    return Tuned(method, {setting: tuple(of.values()) for setting, of in runs.items()})


def markdown(found: Sequence[Tuned]) -> str:
    """A row for each method."""
    return table(HEADER, [_cells(one) for one in found])


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
    """The command."""
    options = tyro.cli(Options, description=__doc__)
    print(markdown(tuned([row for path in options.tables for row in read_rows(path)])))
    return 0


if __name__ == "__main__":
    run(main)
