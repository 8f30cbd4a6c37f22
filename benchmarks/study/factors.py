"""Compare each method of a table with one of them on the same goal graphs, to see what makes the difference.

    python -m benchmarks.study.factors TABLE.csv --reference "hippo as it is"

TABLE.csv is a table of training runs as `benchmarks.study.statistics` takes it. On each graph the median steps of a
method are divided by those of the reference. The table shows the median of these ratios over the graphs, with an
interval from resamples of the graphs and of the seeds of each. Above 1 the reference is faster. Where only the other
method never gets there the ratio is infinite, where only the reference does not it is 0; where neither does it counts
as 1. A graph has no ratio if the two have the same runs on it. That happens where only one goal can be reached at any
time, so that it does not matter who picks it. Success is the median over all graphs, in brackets the quartiles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import tyro

from benchmarks.study.bootstrap import Bootstrap
from benchmarks.study.correlations import Estimate
from benchmarks.study.hierarchy import ENOUGH, QUARTILES
from benchmarks.study.paired import graphs_of_equal_runs, pair
from benchmarks.study.tables import Row, first_seeds, measures_for, read_rows
from benchmarks.study.trained import Milestone, method_names
from hierroom.support.cli import run
from hierroom.support.errors import InputError
from hierroom.support.tables import markdown_table

RATIO_HEADER = ("compared by", "steps / reference's", "verdict", "slower on")
HEADER = ("method", *RATIO_HEADER, "success", f"above {ENOUGH:.0%} on")


@dataclass(frozen=True)
class Options:
    """Hold the methods of a table against one of them.

    Args:
        table: the training runs.
        reference: the method that the others are held against.
        measures: the measures of the goal graphs, which know which of them are twins; by default measures.csv next to
            the table, else its study's.
        outcome: the milestone to compare steps by; by default, for each method, steps_to_95, or steps_to_50 if it or
            the reference never got there on more than a third of the graphs.
        graphs_of: another table of runs; only its graphs are compared.
        seeds: only seeds 0, 1, ..., so many of them, as of a sweep that goes on; all by default.
        bootstrap: how intervals are computed.
    """

    table: tyro.conf.Positional[Path]
    reference: str = "hippo as it is"
    measures: Path | None = None
    outcome: Milestone | None = None
    graphs_of: Path | None = None
    seeds: int | None = None
    bootstrap: tyro.conf.OmitArgPrefixes[Bootstrap] = field(default_factory=Bootstrap)


@dataclass(frozen=True)
class Factor:
    """A method compared with the reference.

    Args:
        method: its name.
        outcome: the milestone.
        graphs: on how many goal graphs both were trained.
        compared: on how many of these their runs differ.
        slower: on how many of those its median steps are more than the reference's.
        ratio: median over the graphs of its steps by the reference's, above 1 where the reference is faster; None for
            the reference.
        success: median over the graphs of the success rate at the end of training, 0 to 1, and the quartiles.
        works: on how many graphs that is above 50%.
    """

    method: str
    outcome: Milestone
    graphs: int
    compared: int
    slower: int
    ratio: Estimate | None
    success: Estimate
    works: int


def factors(rows: Sequence[Row], measured: Sequence[Row], options: Options) -> list[Factor]:
    """Compare each method of a table, the reference first, with the reference.

    Args:
        rows: of the table of training runs.
        measured: of the table of measures.
        options: the reference, the outcome, the seeds, and how intervals are computed.

    Raises:
        InputError: as `first_seeds` or `pair`.
    """
    rows, reference = first_seeds(rows, options.seeds), options.reference
    names = dict.fromkeys([reference, *method_names(rows)])
    return [compare_methods(rows, measured, (name, reference), options.outcome, options.bootstrap) for name in names]


def compare_methods(
    rows: Sequence[Row],
    measured: Sequence[Row],
    methods: tuple[str, str],
    outcome: Milestone | None,
    bootstrap: Bootstrap,
) -> Factor:
    """Compare the steps of a method with those of a reference, and how often each succeeds.

    Args:
        rows: of the table of training runs.
        measured: of the table of measures.
        methods: the method, and the reference.
        outcome: the milestone, as for `pair`.
        bootstrap: how the interval is computed.

    Raises:
        InputError: as `pair`, or if all runs of the two are the same.
    """
    both = pair(rows, measured, methods, outcome)
    name, reference = methods
    success, equal = both.success[0], graphs_of_equal_runs(rows, methods)
    apart = both.on([graph for graph in both.graphs if graph not in equal])
    if name != reference and not apart.graphs:
        raise InputError(f"the runs of {name} and of {reference} are the same on every goal graph")
    return Factor(
        name,
        both.outcome,
        len(both.graphs),
        len(apart.graphs),
        int((apart.ratios > 1).sum()),
        None if name == reference else apart.median_ratio(bootstrap),
        Estimate(float(np.median(success)), *(float(np.quantile(success, q, method=side)) for q, side in QUARTILES)),
        int((success > ENOUGH).sum()),
    )


def markdown(found: Sequence[Factor]) -> str:
    """Return a row for each method; the reference is compared with none."""
    return markdown_table(HEADER, [cells(one) for one in found])


def cells(one: Factor) -> list[str]:
    """Return the cells of a method, under `HEADER`."""
    middle, low, high = (f"{number:.1%}" for number in one.success)
    success = middle if low == high else f"{middle} ({low} to {high})"
    return [one.method, *ratio_cells(one), success, f"{one.works} of {one.graphs}"]


def ratio_cells(one: Factor) -> list[str]:
    """Return the cells of a method's steps divided by those of the reference, under `RATIO_HEADER`."""
    if one.ratio is None:
        return ["-"] * len(RATIO_HEADER)
    value, low, high = (f"{number:.2f}" if number < np.inf else "∞" for number in one.ratio)
    verdict = "slower" if one.ratio.low > 1 else "faster" if one.ratio.high < 1 else "no significant difference"
    ratio = f"{value} [{low}, {high}]"
    if np.isnan(one.ratio.low):  # a single seed on few graphs
        ratio, verdict = value, "-"
    outcome = one.outcome.replace("_", " ") + "%"
    return [outcome, ratio, verdict, f"{one.slower} of {one.compared}"]


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    rows = read_rows(options.table)
    if options.graphs_of is not None:
        graphs = {row["graph"] for row in read_rows(options.graphs_of)}
        rows = [row for row in rows if row["graph"] in graphs]
    print(markdown(factors(rows, measures_for(options.table, options.measures), options)))
    return 0


if __name__ == "__main__":
    run(main)
