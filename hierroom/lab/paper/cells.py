"""The cells of Table 3: what the paper prints for a method on a graph, and what our runs gave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from hierroom.lab.paper.published import PAPER_TABLE_3
from hierroom.lab.paper.runs import cell, mean_and_interval
from hierroom.lab.sweep.table import Row
from hierroom.runs.logs.learning_curve import first_crossing
from hierroom.support.errors import InputError

Curves = Mapping[str, Sequence[Row]]
"""The evaluations of runs by the digests of their rows."""

STEPS_ENDS = ("", "_low", "_high")
"""The endings of the columns of steps: the median of our seeds, the fastest and the slowest."""

LEAST_SUCCESS = 1.0
"""A lower success rate, in percent, is less than our evaluations can tell."""

LIMIT = 1000
"""The time limit in steps, of which lengths are told in percent."""


@dataclass(frozen=True)
class ComparedCell:
    """A method on a graph: the paper's numbers and ours, in percent.

    Args:
        method: its name.
        graph: a to g.
        size: of our grid.
        seeds: of our runs.
        paper_success: success rate.
        success: mean over our seeds.
        success_half_width: of its 95% interval over seeds; NaN of a single one.
        paper_length: episode length in percent of the limit; None where the paper prints a dash.
        length: mean over our seeds.
        length_half_width: of its 95% interval.
        steps_to_paper: training steps until our evaluated success rate reached the paper's, the median of our seeds;
            infinite where half of them or more never did, NaN where the paper's is below 1%, which is less than our
            evaluations can tell.
        steps_to_paper_low: of our fastest seed.
        steps_to_paper_high: of our slowest.
        steps_to_95: likewise until 95%.
        steps_to_95_low: of our fastest seed.
        steps_to_95_high: of our slowest.
    """

    method: str
    graph: str
    size: int
    seeds: int
    paper_success: float
    success: float
    success_half_width: float
    paper_length: float | None
    length: float
    length_half_width: float
    steps_to_paper: float
    steps_to_paper_low: float
    steps_to_paper_high: float
    steps_to_95: float
    steps_to_95_low: float
    steps_to_95_high: float


def table_3(rows: Sequence[Row], curves: Curves, sizes: Sequence[int]) -> list[ComparedCell]:
    """Our numbers beside the paper's, of all that was trained.

    Args:
        rows: of the sweep.
        curves: the learning curves by the digests of their rows.
        sizes: of the grids.
    """
    cells = []
    for size in sizes:
        for (method, graph), printed in PAPER_TABLE_3.items():
            runs = cell(rows, method, graph, size)
            if runs:
                success, length = (np.array([float(row[name]) for row in runs]) for name in ("success_rate", "length"))
                ours: dict[str, float] = {}
                for name, values in (("success", 100 * success), ("length", 100 * length / LIMIT)):
                    ours[name], ours[f"{name}_half_width"] = map(float, mean_and_interval(values))
                own = [curve_of(run, curves) for run in runs]
                can_be_told = printed.success >= LEAST_SUCCESS
                to_paper = _steps_to(printed.success, own) if can_be_told else (np.nan,) * len(STEPS_ENDS)
                for name, steps in (("steps_to_paper", to_paper), ("steps_to_95", _steps_to(95, own))):
                    ours |= {f"{name}{end}": value for end, value in zip(STEPS_ENDS, steps, strict=True)}
                paper = {"paper_success": printed.success, "paper_length": printed.length}
                cells.append(ComparedCell(method, graph, size, len(runs), **paper, **ours))
    return cells


def curve_of(run: Row, curves: Curves) -> Sequence[Row]:
    """The evaluations of a run."""
    if not curves.get(run["digest"]):
        raise InputError(
            f"curves.csv has no learning curve of {run['method']} on {run['graph']} with seed {run['seed']}; "
            "delete its row from sweep.csv, and it is written again"
        )
    return curves[run["digest"]]


def _steps_to(percent: float, curves: Sequence[Sequence[Row]]) -> tuple[float, float, float]:
    """The steps at which learning curves reach a success rate: the median over the seeds, the fewest and the most."""
    reached = []
    for curve in curves:
        steps, success = (np.array([float(point[name]) for point in curve]) for name in ("steps", "success_rate"))
        reached.append(first_crossing(steps, success, percent / 100))
    return median(reached), min(reached), max(reached)
