"""Compare methods of a table as a file names them, each pair on the same goal graphs.

    python -m benchmarks.study.comparisons TABLE.csv COMPARISONS.toml

TABLE.csv is a table of training runs as `benchmarks.study.factors` takes it, and each ratio and its interval are those
of that command, with a reference for each method. COMPARISONS.toml holds an entry for each comparison:

    [[comparisons]]
    method = "ppo-bonus gamma 0.98"
    reference = "hippo gamma 0.98"
    outcome = "steps_to_50"  # where it is not the milestone of the rules
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import tyro

from benchmarks.study.bootstrap import Bootstrap
from benchmarks.study.factors import RATIO_HEADER, Factor, compare_methods, ratio_cells
from benchmarks.study.tables import Row, first_seeds, measures_for, read_rows
from benchmarks.study.trained import Milestone, milestone_of
from hierroom.support.cli import run
from hierroom.support.errors import InputError
from hierroom.support.files import read_toml
from hierroom.support.tables import markdown_table


@dataclass(frozen=True)
class Options:
    """Compare methods with each other.

    Args:
        table: the training runs.
        comparisons: the file that names the methods.
        measures: the measures of the goal graphs; by default measures.csv next to the table, else its study's.
        seeds: only seeds 0, 1, ..., so many of them; all by default.
        bootstrap: how intervals are computed.
    """

    table: tyro.conf.Positional[Path]
    comparisons: tyro.conf.Positional[Path]
    measures: Path | None = None
    seeds: int | None = None
    bootstrap: tyro.conf.OmitArgPrefixes[Bootstrap] = field(default_factory=Bootstrap)


@dataclass(frozen=True)
class PlannedComparison:
    """Two methods that are to be compared.

    Args:
        method: the name of the one.
        reference: that of the other; its steps divide those of the first.
        outcome: the milestone; None: that of the study's rules.
    """

    method: str
    reference: str
    outcome: Milestone | None = None


def read_comparisons(path: Path) -> list[PlannedComparison]:
    """Return the comparisons that a file names.

    Raises:
        InputError: if it cannot be read, holds anything else, or an entry lacks a method or another method as its
            reference, or has an unknown key or milestone.
    """
    others = read_toml(path, "comparisons")
    entries = others.pop("comparisons", [])
    if others or not isinstance(entries, list) or not entries:
        found = f", and holds {', '.join(others)}" if others else ""
        raise InputError(f"{path} takes only comparisons, each beginning with [[comparisons]]{found}")
    return [_planned(entry, f"{path}, comparison {number}") for number, entry in enumerate(entries, start=1)]


def _planned(entry: object, place: str) -> PlannedComparison:
    names = {"method", "reference"}
    if not isinstance(entry, dict) or not names <= set(entry) <= names | {"outcome"}:
        raise InputError(f"{place} has a method, a reference and, if need be, an outcome, not {entry!r}")
    for name in sorted(names):
        if not isinstance(entry[name], str):
            raise InputError(f"{place}: the name of a method is text, not {entry[name]!r}")
    if entry["method"] == entry["reference"]:
        raise InputError(f"{place}: {entry['method']!r} is compared with itself")
    return PlannedComparison(entry["method"], entry["reference"], milestone_of(entry.get("outcome"), place))


def compare(
    rows: Sequence[Row], measured: Sequence[Row], planned: Sequence[PlannedComparison], options: Options
) -> list[Factor]:
    """Return the method of each comparison by its reference.

    Args:
        rows: of the table of training runs.
        measured: of the table of measures.
        planned: which methods.
        options: the seeds, and how intervals are computed.

    Raises:
        InputError: as `first_seeds` or `compare_methods`.
    """
    rows = first_seeds(rows, options.seeds)
    return [
        compare_methods(rows, measured, (one.method, one.reference), one.outcome, options.bootstrap) for one in planned
    ]


def markdown(planned: Sequence[PlannedComparison], found: Sequence[Factor]) -> str:
    """Return a row for each comparison."""
    rows = [[one.method, one.reference, *ratio_cells(factor)] for one, factor in zip(planned, found, strict=True)]
    return markdown_table(["method", "reference", *RATIO_HEADER], rows)


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    planned = read_comparisons(options.comparisons)
    found = compare(read_rows(options.table), measures_for(options.table, options.measures), planned, options)
    print(markdown(planned, found))
    return 0


if __name__ == "__main__":
    run(main)
