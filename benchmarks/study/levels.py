"""Does hierarchy pay on other levels? Two methods compared on each kind of levels, on the same goal graphs.

    python -m benchmarks.study.levels benchmarks/results/study_levels/sweep.csv

The table is one of training runs as `benchmarks.study.factors` takes it. A variant is named by its levels, a comma and
its method. Runs with the same levels, such as `larger grid`, are compared. Ratios and intervals are those of
`benchmarks.study.factors`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import tyro

from benchmarks.study import factors
from benchmarks.study.factors import Factor
from benchmarks.study.tables import Row, measures_for, read_rows
from hierroom.support.cli import run
from hierroom.support.errors import InputError
from hierroom.support.tables import markdown_table


@dataclass(frozen=True)
class Options(factors.Options):
    """Hold the methods against one of them, on each kind of levels.

    Args:
        reference: the method that the others are held against.
    """

    reference: str = "hippo"


def levels(rows: Sequence[Row], measured: Sequence[Row], options: Options) -> dict[str, list[Factor]]:
    """Compare the methods with the reference on each kind of levels, the reference first.

    Args:
        rows: of the table of training runs.
        measured: of the table of measures.
        options: the reference, the outcome, the seeds, and how intervals are computed.

    Raises:
        InputError: if a variant does not tell its levels, or as `factors.factors`.
    """
    kinds: dict[str, list[Row]] = {}
    for row in rows:
        kind, comma, _ = row.get("variant", "").partition(", ")
        if not comma:
            raise InputError(f"a variant is called as its levels, a comma and its method, not {row.get('variant')!r}")
        kinds.setdefault(kind, []).append(row)
    return {kind: factors.factors(of_kind, measured, options) for kind, of_kind in kinds.items()}


def markdown(found: Mapping[str, Sequence[Factor]]) -> str:
    """Return a row for each kind of levels and each method."""
    rows = [[kind, *factors.cells(one)] for kind, several in found.items() for one in several]
    return markdown_table(["levels", *factors.HEADER], rows)


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    print(markdown(levels(read_rows(options.table), measures_for(options.table, options.measures), options)))
    return 0


if __name__ == "__main__":
    run(main)
