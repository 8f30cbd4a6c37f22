"""Which measure, computed before training, predicts how long training takes?

    python -m benchmarks.study.statistics TABLE.csv

TABLE.csv is a tidy table of training runs, one a row: graph, method, seed, steps_to_95 and the like (empty: never
reached), as `python -m hierroom.sweep` writes it. `python -m benchmarks.study.measures_table` makes the measures.
`benchmarks/study/correlations.py` says what each number is, docs/study-rules.md what would refute which claim.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console
from rich.progress import Progress

from benchmarks.study.bootstrap import Bootstrap
from benchmarks.study.correlations import Estimate, ceiling, estimates, noise_of_twins, split_half, twin_factor
from benchmarks.study.markdown import table
from benchmarks.study.tables import MEASURES_PATH, Row, first_seeds, known_measures, read_rows
from benchmarks.study.trained import FEWEST_GRAPHS, Outcome, Trained, among, by_rule, measures_of, read_trained
from hierroom.cli import run
from hierroom.errors import InputError
from hierroom.files import write_atomically

PRINTED = (
    "spearman",
    "kendall",
    "given goals",
    "given exit depth",
    "at fixed goals",
    "minus goals",
    "minus exit depth",
    "minus hitting time",
)


@dataclass(frozen=True)
class Options:
    """Hold the measures against what was trained.

    Args:
        table: the training runs.
        measures: the measures of their goal graphs.
        outcome: what says how hard a graph was; by default steps_to_95, or steps_to_50 for a method that never got
            there on more than a third of the graphs.
        rooms: only goal graphs of so many rooms; all by default.
        seeds: only seeds 0, 1, ..., so many of them, as of a sweep that goes on; all by default.
        bootstrap: how intervals are computed.
        out: a CSV file for every correlation, those at each number of goals too.
    """

    table: tyro.conf.Positional[Path]
    measures: Path = MEASURES_PATH
    outcome: Outcome | None = None
    rooms: tuple[int, ...] = ()
    seeds: int | None = None
    bootstrap: tyro.conf.OmitArgPrefixes[Bootstrap] = field(default_factory=Bootstrap)
    out: Path | None = None


@dataclass(frozen=True)
class Result:
    """What was found of one method.

    Args:
        outcome: what says how hard a graph was.
        trained: its outcomes.
        estimates: by measure and statistic.
        halves: the split-half reliability of the seeds.
        twins: the correlation of graphs and their twins.
        factor: by which these differ.
    """

    outcome: Outcome
    trained: Trained
    estimates: Mapping[tuple[str, str], Estimate]
    halves: Estimate
    twins: Estimate
    factor: float

    @property
    def n_seeds(self) -> tuple[int, int]:
        """The fewest and the most seeds of a goal graph."""
        several = (~np.isnan(self.trained.outcomes)).sum(axis=1)
        return int(several.min()), int(several.max())

    @property
    def measures(self) -> list[str]:
        """The measures, the best first."""
        names = dict.fromkeys(name for name, _ in self.estimates)
        return sorted(names, key=lambda name: -np.nan_to_num(self.estimates[name, "spearman"].value, nan=-2))


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
    console = Console(stderr=True)
    every: list[tuple[Outcome, Trained]]
    if options.outcome is None:
        every = [(outcome, one) for outcome, several in by_rule(rows, measured).items() for one in several]
    else:
        every = [(options.outcome, one) for one in read_trained(rows, measured, options.outcome)]
    chosen = {row["graph"] for row in measured if not options.rooms or int(row["rooms"]) in options.rooms}
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        for outcome, unfiltered in every:
            trained = among(unfiltered, chosen)
            if (n := len(trained.graphs)) < FEWEST_GRAPHS:
                raise InputError(f"a correlation needs {FEWEST_GRAPHS} goal graphs or more; {trained.method} has {n}")
            task = bar.add_task(trained.method, total=options.bootstrap.resamples)
            found = estimates(
                trained,
                measures_of(trained.graphs, measured),
                np.array([goals_of[graph] for graph in trained.graphs]),
                n_resamples=options.bootstrap.resamples,
                level=options.bootstrap.level,
                seed=options.bootstrap.seed,
                progress=lambda done, task=task: bar.update(task, completed=done),
            )
            settings = {"level": options.bootstrap.level, "seed": options.bootstrap.seed}
            halves = split_half(trained, n_splits=options.bootstrap.resamples, **settings)
            twins = noise_of_twins(trained, n_resamples=options.bootstrap.resamples, **settings)
            results.append(Result(outcome, trained, found, halves, twins, twin_factor(trained)))
    return results


def markdown(result: Result) -> str:
    """The table of one method, and below it how far its graphs can be ranked at all."""
    caption = f"{result.outcome}, {len(result.trained.graphs)} goal graphs, {seeds_text(*result.n_seeds)}"
    if result.outcome != "success_rate":
        caption += f", never reached by half of the seeds on {result.trained.never}"
    lines = [f"**{result.trained.method}**: {caption}", "", measure_table(result.estimates, result.measures)]
    noise = [] if np.isnan(result.halves.value) else [reliability_text(result.halves)]
    if not np.isnan(result.factor):
        twins = f"{len(result.trained.twins)} twins: {result.twins}"
        noise.append(f"{twins}, which differ by a factor of {result.factor:.2f}")
    return "\n".join([*lines, *(["", "; ".join(noise)] if noise else [])])


def reliability_text(halves: Estimate) -> str:
    """How far the noise of the seeds lets graphs be ranked at all."""
    return f"split-half reliability: {halves}; a measure without noise could have: {ceiling(halves)}"


def seeds_text(fewest: int, most: int) -> str:
    """How many seeds goal graphs have, in words."""
    return f"{fewest} to {most} seeds" if fewest < most else "1 seed" if most == 1 else f"{most} seeds"


def measure_table(estimates: Mapping[tuple[str, str], Estimate], measures: Sequence[str]) -> str:
    """A row for each measure, in Markdown.

    Args:
        estimates: by measure and statistic.
        measures: those shown.
    """
    return table(["measure", *PRINTED], [[name, *(str(estimates[name, one]) for one in PRINTED)] for name in measures])


def csv_text(results: list[Result]) -> str:
    """Every number of every method as a row."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        ["method", "outcome", "measure", "statistic", "value", "low", "high", "graphs", "seeds_min", "seeds_max"]
    )
    for result in results:
        noise = {("seeds", "halves"): result.halves, ("twins", "spearman"): result.twins}
        for (measure, statistic), estimate in {**result.estimates, **noise}.items():
            numbers = ("" if np.isnan(number) else f"{number:.6g}" for number in estimate)
            n = len(result.trained.twins) if measure == "twins" else len(result.trained.graphs)
            names = result.trained.method, result.outcome, measure, statistic
            writer.writerow([*names, *numbers, n, *result.n_seeds])
    return text.getvalue()


def main() -> int:
    """The command."""
    options = tyro.cli(Options, description=__doc__)
    measured = known_measures(options.measures)
    results = study(read_rows(options.table), measured, options)
    print("\n\n".join(markdown(result) for result in results))
    if options.out is not None:
        write_atomically(options.out, csv_text(results).encode())
    return 0


if __name__ == "__main__":
    run(main)
