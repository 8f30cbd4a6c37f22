"""Correlate measures that are computed before training with how long training takes.

    python -m benchmarks.study.statistics TABLE.csv

TABLE.csv is a tidy table of training runs, one a row: graph, method, seed, steps_to_95 and the like (empty: never
reached), as `python -m hierroom sweep` writes it. `python -m benchmarks.study.measures_table` makes the measures.
`benchmarks/study/correlations.py` says what each number is, docs/study-rules.md what would refute which claim.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import tyro

from benchmarks.study.bootstrap import Bootstrap
from benchmarks.study.correlations import Estimate, estimates, noise_of_twins, split_half, twin_factor
from benchmarks.study.result import HALVES, NEVER, TWIN_FACTOR, TWINS, Result, csv_text, markdown
from benchmarks.study.tables import Row, first_seeds, measures_for, read_rows
from benchmarks.study.trained import FEWEST_GRAPHS, Outcome, Trained, among, by_rule, measures_of, read_trained
from hierroom.support.cli import progress_bar, run
from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically


@dataclass(frozen=True)
class Options:
    """Hold the measures against what was trained.

    Args:
        table: the training runs.
        measures: the measures of their goal graphs; by default measures.csv next to the table, else its study's.
        outcome: what says how hard a graph was; by default steps_to_95, or steps_to_50 for a method that never got
            there on more than a third of the graphs.
        rooms: only goal graphs of so many rooms; all by default.
        seeds: only seeds 0, 1, ..., so many of them, as of a sweep that goes on; all by default.
        bootstrap: how intervals are computed.
        out: a CSV file for every correlation, those at each number of goals too.
    """

    table: tyro.conf.Positional[Path]
    measures: Path | None = None
    outcome: Outcome | None = None
    rooms: tuple[int, ...] = ()
    seeds: int | None = None
    bootstrap: tyro.conf.OmitArgPrefixes[Bootstrap] = field(default_factory=Bootstrap)
    out: Path | None = None


def study(rows: list[Row], measured: list[Row], options: Options) -> list[Result]:
    """Every statistic of each method of a table.

    Args:
        rows: of the table of training runs.
        measured: of the table of measures.
        options: outcome, rooms, seeds, and how intervals are computed.

    Raises:
        InputError: as `read_trained`, or if a method has fewer than four graphs.
    """
    rows, results = first_seeds(rows, options.seeds), []
    goals_of = {row["graph"]: float(row["goals"]) for row in measured}
    every: list[tuple[Outcome, Trained]]
    if options.outcome is None:
        every = [(outcome, one) for outcome, several in by_rule(rows, measured).items() for one in several]
    else:
        every = [(options.outcome, one) for one in read_trained(rows, measured, options.outcome)]
    chosen = {row["graph"] for row in measured if not options.rooms or int(row["rooms"]) in options.rooms}
    with progress_bar() as bar:
        for outcome, unfiltered in every:
            trained = among(unfiltered, chosen)
            if (n := len(trained.graphs)) < FEWEST_GRAPHS:
                raise InputError(f"a correlation needs {FEWEST_GRAPHS} goal graphs or more; {trained.method} has {n}")
            task = bar.add_task(trained.method, total=options.bootstrap.resamples)
            found = estimates(
                trained,
                measures_of(trained.graphs, measured),
                np.array([goals_of[graph] for graph in trained.graphs]),
                options.bootstrap,
                lambda done, task=task: bar.update(task, completed=done),
            )
            noise = {
                NEVER: Estimate(trained.never, np.nan, np.nan),
                HALVES: split_half(trained, options.bootstrap),
                TWINS: noise_of_twins(trained, options.bootstrap),
                TWIN_FACTOR: Estimate(twin_factor(trained), np.nan, np.nan),
            }
            several = (~np.isnan(trained.outcomes)).sum(axis=1)
            seeds = int(several.min()), int(several.max())
            results.append(Result(trained.method, outcome, n, len(trained.twins), seeds, {**found, **noise}))
    return results


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    measured = measures_for(options.table, options.measures)
    results = study(read_rows(options.table), measured, options)
    print("\n\n".join(markdown(result) for result in results))
    if options.out is not None:
        write_atomically(options.out, csv_text(results).encode())
    return 0


if __name__ == "__main__":
    run(main)
