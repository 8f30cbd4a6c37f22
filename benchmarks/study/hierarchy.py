"""Compare a method with a hierarchy and one without on the same goal graphs, to see when hierarchy pays.

    python -m benchmarks.study.hierarchy TABLE.csv

TABLE.csv is a table of training runs as `benchmarks.study.statistics` takes it. On each graph the median steps of the
flat method are divided by those of the hierarchical one; the interval is of resamples of the seeds of both. Where only
the flat method never gets there the ratio is infinite, where only the hierarchical one does not it is 0; where neither
does the ratio is unknown, and counts as 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
import tyro

from benchmarks.study.bootstrap import Bootstrap
from benchmarks.study.lead import sentence as lead_sentence
from benchmarks.study.paired import Paired, median_ratios, pair
from benchmarks.study.tables import Row, first_seeds, measures_for, read_rows
from benchmarks.study.trained import Milestone, measures_of
from benchmarks.study.trend import TRENDS, trends
from benchmarks.study.trend import sentence as trend_sentence
from hierroom.lab.sweep.summary import steps_text
from hierroom.support.cli import run
from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically
from hierroom.support.tables import csv_text, markdown_table

Grouping = Literal["exit_depth", "width", "rooms"]
QUARTILES: tuple[tuple[float, Literal["lower"]], tuple[float, Literal["higher"]]] = ((0.25, "lower"), (0.75, "higher"))
HARDEST = 0.1
"""The share of the graphs that are called the hardest."""
ENOUGH = 0.5
"""A method that ends above this success rate works."""


@dataclass(frozen=True)
class Options:
    """Compare two methods, goal graph by goal graph.

    Args:
        table: the training runs.
        flat: the method without a hierarchy.
        hierarchical: the method with one.
        measures: the measures of the goal graphs; by default measures.csv next to the table, else its study's.
        outcome: the milestone to compare steps by; by default steps_to_95, or steps_to_50 if one of the methods never
            got there on more than a third of the graphs.
        by: the rows of the table: the number of goals before the exit (exit depth), the largest number of rooms at the
            same depth (width, 1 for a chain), or the number of rooms.
        hardest_by: the measure that says which graphs are the hardest; by default the mean steps of random play.
        seeds: only seeds 0, 1, ..., so many of them, as of a sweep that goes on; all by default.
        bootstrap: how intervals are computed.
        out: a CSV file with a row for each graph.
    """

    table: tyro.conf.Positional[Path]
    flat: str = "ppo-bonus"
    hierarchical: str = "hippo"
    measures: Path | None = None
    outcome: Milestone | None = None
    by: Grouping = "exit_depth"
    hardest_by: str | None = None
    seeds: int | None = None
    bootstrap: tyro.conf.OmitArgPrefixes[Bootstrap] = field(default_factory=Bootstrap)
    out: Path | None = None


@dataclass(frozen=True)
class Comparison:
    """Two methods on one goal graph.

    Args:
        graph: its name.
        rooms: its number of rooms.
        exit_depth: the number of its goals that must be achieved before the exit can be reached.
        width: its largest number of rooms at the same depth.
        outcome: the milestone.
        flat: median steps of the method without a hierarchy, ``inf`` where half of its seeds never got there.
        hierarchical: those of the method with one.
        ratio: of the first to the second, above 1 where hierarchy pays.
        low: the lower end of its interval; NaN where a method has a single seed.
        high: the upper end.
        flat_success: median success rate at the end of training, 0 to 1.
        hierarchical_success: the same of the hierarchical method.
    """

    graph: str
    rooms: int
    exit_depth: int
    width: int
    outcome: Milestone
    flat: float
    hierarchical: float
    ratio: float
    low: float
    high: float
    flat_success: float
    hierarchical_success: float


def both_methods(rows: Sequence[Row], measured: Sequence[Row], options: Options) -> Paired:
    """Return the two methods on the goal graphs that both were trained on.

    Args:
        rows: of the table of training runs.
        measured: of the table of measures.
        options: the methods, the outcome, and the seeds.

    Raises:
        InputError: as `first_seeds` or `pair`.
    """
    both, rows = (options.flat, options.hierarchical), first_seeds(rows, options.seeds)
    return pair(rows, measured, both, options.outcome, alike=("steps", "size", "preset"))


def compare(found: Paired, measured: Sequence[Row], options: Options) -> list[Comparison]:
    """Return the two methods on each goal graph, in the order of the table.

    Args:
        found: the two, as `both_methods` gives them.
        measured: of the table of measures.
        options: how intervals are computed.
    """
    low, high = options.bootstrap.interval(found.resampled_ratios(options.bootstrap))
    low[found.has_single_seed] = high[found.has_single_seed] = np.nan
    counts_of = {row["graph"]: (int(row["rooms"]), int(row["exit_depth"]), int(row["width"])) for row in measured}
    numbers = zip(*found.medians, found.ratios, low, high, *found.success, strict=True)
    return [
        Comparison(graph, *counts_of[graph], found.outcome, *map(float, values))
        for graph, values in zip(found.graphs, numbers, strict=True)
    ]


def markdown(found: Sequence[Comparison], options: Options) -> str:
    """Return a row for each exit depth, or value of `options.by`: on how many graphs hierarchy pays and a method works.

    Numbers are medians over the graphs, in brackets the quartiles. A single seed does not show whether
    hierarchy pays or costs. Where there is no middle graph, the median number of steps is the larger one.
    """
    both = options.hierarchical, options.flat
    header = [
        options.by.replace("_", " "),
        "graphs",
        *(f"{name}: {found[0].outcome}" for name in both),
        "ratio",
        "pays on",
        "costs on",
    ]
    header += [f"{name}: reached on" for name in both] + [f"{name}: above {ENOUGH:.0%} on" for name in both]
    rows = []
    for value in sorted({getattr(one, options.by) for one in found}):
        alike = [one for one in found if getattr(one, options.by) == value]
        steps = [one.hierarchical for one in alike], [one.flat for one in alike]
        pays, costs = (sum(ahead) for ahead in ([one.low > 1 for one in alike], [one.high < 1 for one in alike]))
        answers = ["-", "-"] if any(np.isnan(one.low) for one in alike) else [str(pays), str(costs)]
        ratios = [one.ratio for one in alike]
        middle = float(median_ratios(np.array([ratios]))[0])
        reached = [str(np.isfinite(several).sum()) for several in steps]
        rows.append(
            [
                str(value),
                str(len(alike)),
                *map(_steps, steps),
                _between(_ratio(middle), ratios, _ratio),
                *answers,
                *reached,
                *_working(alike),
            ]
        )
    return markdown_table(header, rows)


def hardest(found: Sequence[Comparison], measured: Sequence[Row], measure: str) -> list[Comparison]:
    """Return the tenth of the goal graphs that a measure calls the hardest, with all that tie with the last of them.

    Raises:
        InputError: if the measure is unknown, missing for a graph, or the same for all.
    """
    measures = measures_of([one.graph for one in found], measured)
    if measure not in measures:
        raise InputError(f"the measure of the hardest must be one of {', '.join(measures)}, not {measure!r}")
    least = np.sort(measures[measure])[-max(1, round(HARDEST * len(found)))]
    return [one for one, value in zip(found, measures[measure], strict=True) if value >= least]


def text(found: Paired, compared: Sequence[Comparison], measured: Sequence[Row], options: Options) -> str:
    """Return the table, the first method, on how many of the hardest graphs each works, and whether the lead grows.

    Args:
        found: the two methods.
        compared: on each goal graph.
        measured: of the table of measures.
        options: which measure says how hard a graph is, and how intervals are computed.

    Raises:
        InputError: as `hardest`.
    """
    lead = lead_sentence(found, (options.flat, options.hierarchical))
    works = _works(compared, measured, options)
    trend = trend_sentence(trends(found, measures_of(found.graphs, measured), options.bootstrap))
    return "\n\n".join(filter(None, [markdown(compared, options), lead, works, trend]))


def _works(found: Sequence[Comparison], measured: Sequence[Row], options: Options) -> str:
    """On how many of the hardest goal graphs each method works.

    Raises:
        InputError: as `hardest`.
    """
    known = measures_of([one.graph for one in found], measured)
    measure = options.hardest_by or next((name for name in reversed(TRENDS) if name in known), TRENDS[-1])
    few = hardest(found, measured, measure)
    with_hierarchy, without = _working(few)
    where = f"Hardest tenth by {measure}, with ties {len(few)} of {len(found)} goal graphs"
    ends = f"{options.hierarchical} ends above {ENOUGH:.0%} success on {with_hierarchy}, {options.flat} on {without}"
    return f"{where}: {ends}."


def _steps(values: Sequence[float]) -> str:
    def text(steps: float) -> str:
        return steps_text(steps) if np.isfinite(steps) else "-"

    return _between(text(float(np.quantile(values, 0.5, method="higher"))), values, text)


def _between(middle: str, values: Sequence[float], text: Callable[[float], str]) -> str:
    """Return a median and the quartiles around it."""
    low, high = (text(float(np.quantile(values, q, method=side))) for q, side in QUARTILES)
    return middle if low == high else f"{middle} ({low} to {high})"


def _ratio(value: float) -> str:
    return f"{value:.1f}" if np.isfinite(value) else "∞"


def _working(comparisons: Sequence[Comparison]) -> list[str]:
    return [
        str(sum(one.hierarchical_success > ENOUGH for one in comparisons)),
        str(sum(one.flat_success > ENOUGH for one in comparisons)),
    ]


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    measured = measures_for(options.table, options.measures)
    found = both_methods(read_rows(options.table), measured, options)
    compared = compare(found, measured, options)
    print(text(found, compared, measured, options))
    if options.out is not None:
        write_atomically(options.out, csv_text(map(asdict, compared)))
    return 0


if __name__ == "__main__":
    run(main)
