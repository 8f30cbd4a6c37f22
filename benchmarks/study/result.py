"""Results of one method, how well measures predicted what was trained: as text, and as rows of a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.study.correlations import Estimate, ceiling
from benchmarks.study.tables import Row
from hierroom.support.errors import InputError
from hierroom.support.tables import csv_text as csv_of
from hierroom.support.tables import markdown_table

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
COLUMNS = ("method", "outcome", "measure", "statistic", "value", "low", "high", "graphs", "seeds_min", "seeds_max")
NEVER, HALVES = ("seeds", "never"), ("seeds", "halves")
TWINS, TWIN_FACTOR = ("twins", "spearman"), ("twins", "factor")
NOISE = (NEVER, HALVES, TWINS, TWIN_FACTOR)


@dataclass(frozen=True)
class Result:
    """The correlations of measures with the difficulty of goal graphs to one method, and the limits of noise.

    Args:
        method: its name, with its settings.
        outcome: what says how hard a goal graph was.
        graphs: how many goal graphs.
        twins: how many of these have a twin.
        seeds: the fewest and the most seeds of a goal graph.
        estimates: by measure and statistic. Those of `NOISE` are the number of graphs on which half of the seeds missed
            the milestone, the split-half reliability of the seeds, and the correlation and factor between twins.
    """

    method: str
    outcome: str
    graphs: int
    twins: int
    seeds: tuple[int, int]
    estimates: Mapping[tuple[str, str], Estimate]

    @property
    def measures(self) -> list[str]:
        """The measures, the best first."""
        names = dict.fromkeys(name for name, statistic in self.estimates if (name, statistic) not in NOISE)
        return sorted(names, key=lambda name: -np.nan_to_num(self.estimates[name, "spearman"].value, nan=-2))


def markdown(result: Result) -> str:
    """Return the table of one method, the best measure first, and below it how far its graphs can be ranked at all."""
    estimates, is_of_steps = result.estimates, result.outcome != "success_rate"
    caption = f"{_outcome_text(result)}, {result.graphs} goal graphs, {_seeds_text(*result.seeds)}"
    caption += f"; on {estimates[NEVER].value:.0f} half of the seeds or more never get there" if is_of_steps else ""
    rows = [[name, *(str(estimates[name, one]) for one in PRINTED)] for name in result.measures]
    lines = [f"**{result.method}**, {caption}:", "", markdown_table(["measure", *PRINTED], rows)]
    if not np.isnan(estimates[HALVES].value):
        could_have = f"a measure without noise could have: {ceiling(estimates[HALVES])}"
        lines += ["", f"split-half reliability: {estimates[HALVES]}; {could_have}"]
    if not np.isnan(estimates[TWIN_FACTOR].value):
        factor = f"which differ by a factor of {estimates[TWIN_FACTOR]}"
        lines += ["", f"{result.twins} twins: {estimates[TWINS]}, {factor}"]
    return "\n".join(lines)


def side_by_side(results: Sequence[Result], shown: Sequence[str]) -> str:
    """One table of all methods, two numbers of each: the rank correlation, and how far it is above the exit depth's.

    Args:
        results: of each method.
        shown: the measures, a row each; all, the best of the first method first, where none is named.

    Raises:
        InputError: if there is no such measure.
    """
    for one in results:
        if unknown := [name for name in shown if name not in one.measures]:
            known = ", ".join(one.measures)
            raise InputError(f"the measures of {one.method} are {known}; there is no {unknown[0]!r}")
    header = [f"{one.method}: {quantity}" for one in results for quantity in (_outcome_text(one), "minus exit depth")]
    rows = [
        [
            name,
            *(str(one.estimates[name, quantity]) for one in results for quantity in ("spearman", "minus exit depth")),
        ]
        for name in shown or results[0].measures
    ]
    return markdown_table(["measure", *header], rows)


def _outcome_text(result: Result) -> str:
    return result.outcome.replace("_", " ") + ("" if result.outcome == "success_rate" else "%")


def _seeds_text(fewest: int, most: int) -> str:
    return f"{fewest} to {most} seeds" if fewest < most else "1 seed" if most == 1 else f"{most} seeds"


def csv_text(results: Sequence[Result]) -> str:
    """Every number of every method as a row."""
    rows = [
        {
            "method": result.method,
            "outcome": result.outcome,
            "measure": measure,
            "statistic": statistic,
            **{name: f"{number:.6g}" for name, number in estimate._asdict().items() if not np.isnan(number)},
            "graphs": result.twins if measure == "twins" else result.graphs,
            "seeds_min": result.seeds[0],
            "seeds_max": result.seeds[1],
        }
        for result in results
        for (measure, statistic), estimate in result.estimates.items()
    ]
    return csv_of(rows, COLUMNS)


def results_of(rows: Sequence[Row]) -> list[Result]:
    """Return the result of each method from rows that `csv_text` wrote.

    Raises:
        InputError: if a number is missing, as of a table that an older version wrote.
    """
    by_method: dict[str, list[Row]] = {}
    for row in rows:
        by_method.setdefault(row["method"], []).append(row)
    return [_result(method, several) for method, several in by_method.items()]


def _result(method: str, rows: Sequence[Row]) -> Result:
    by_name = {(row["measure"], row["statistic"]): row for row in rows}
    estimates = {
        name: Estimate(*(float(row[number] or "nan") for number in ("value", "low", "high")))
        for name, row in by_name.items()
    }
    if missing := [" ".join(name) for name in NOISE if name not in by_name]:
        lacking = f"the correlations of {method} lack {', '.join(missing)}"
        raise InputError(f"{lacking}; python -m benchmarks.page_statistics writes them anew")
    known = by_name[HALVES]
    seeds = int(known["seeds_min"]), int(known["seeds_max"])
    return Result(method, known["outcome"], int(known["graphs"]), int(by_name[TWINS]["graphs"]), seeds, estimates)
