"""The cells of Table 3: the paper's numbers for a method on a graph, and the results of our runs.

A table of cells has a row for each method, graph and size. Success and length are in percent:

- ``seeds``: number of our seeds; ``paper_success``, ``paper_length``: as printed, NaN where the paper prints a dash;
- ``success``, ``length``: means over our seeds; ``success_half_width``, ``length_half_width``: half the widths of their
  95% intervals, NaN for a single seed;
- ``steps_to_paper``: median over our seeds of the training steps until our evaluated success rate reached the paper's;
  infinite if half of the seeds or more never did, NaN if the paper's is below 1%, too little for our evaluations;
- ``steps_to_95``: the same for a rate of 95%; both also with ``_low`` (the fastest seed) and ``_high`` (the slowest).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import median
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.paper.published import PAPER_TABLE_3
from benchmarks.paper.runs import cell, mean_and_interval
from hierroom.runs.logs.learning_curve import first_crossing
from hierroom.support.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

Curves = Mapping[str, "pd.DataFrame"]
"""The evaluations of runs by the digests of their rows."""
STEPS_ENDS = ("", "_low", "_high")  # the median of our seeds, the fastest and the slowest
LEAST_SUCCESS = 1.0  # percent that our evaluations can resolve
LIMIT = 1000  # steps; lengths are percentages of it
REFERENCES = ("hippo", "ppo")
"""All methods are compared at the steps where these reach the paper's success: its best method, and best flat one."""


def table_3(rows: pd.DataFrame, curves: Curves, sizes: Sequence[int]) -> pd.DataFrame:
    """Return the cells of all runs on grids of some sizes."""
    import pandas as pd

    cells = []
    for size in sizes:
        for (method, graph), printed in PAPER_TABLE_3.items():
            runs = cell(rows, method, graph, size)
            if runs.empty:
                continue
            own = curves_of(runs, curves)
            is_known = printed.success >= LEAST_SUCCESS
            to_paper = _steps_to(printed.success, own) if is_known else (np.nan,) * len(STEPS_ENDS)
            steps = {"steps_to_paper": to_paper, "steps_to_95": _steps_to(95, own)}
            success, length = (runs[name].astype(float) for name in ("success_rate", "length"))
            cells.append(
                {"method": method, "graph": graph, "size": size, "seeds": len(runs)}
                | {"paper_success": printed.success, **_mean(100 * success, "success")}
                | {"paper_length": printed.length, **_mean(100 * length / LIMIT, "length")}
                | {f"{name}{end}": taken[n] for name, taken in steps.items() for n, end in enumerate(STEPS_ENDS)}
            )
    return pd.DataFrame(cells).astype({"paper_length": float} if cells else {})


def cells_where_reached(cells: pd.DataFrame, rows: pd.DataFrame, curves: Curves, reference: str) -> pd.DataFrame:
    """Return one size's cells at the median steps where a method reached the paper's success, if it did."""
    steps = cells[cells["method"] == reference].set_index("graph")["steps_to_paper"]
    earlier = cells[np.isfinite(cells["graph"].map(steps))].copy()
    for n, one in earlier.iterrows():
        runs = cell(rows, one["method"], one["graph"], one["size"])
        for name, column, scale in (("success", "success_rate", 100), ("length", "length", 100 / LIMIT)):
            mean = _mean(values_at(steps[one["graph"]], runs, curves, column) * scale, name)
            earlier.loc[n, [*mean]] = [*mean.values()]
    return earlier


def values_at(at: float | np.ndarray, runs: pd.DataFrame, curves: Curves, name: str) -> np.ndarray:
    """Return a quantity of runs [S, ...] after some training steps [...]."""
    return np.array([np.interp(at, curve["steps"], curve[name]) for curve in curves_of(runs, curves)])


def curves_of(runs: pd.DataFrame, curves: Curves) -> list[pd.DataFrame]:
    """Return the evaluations of each run."""
    for run in runs[~runs["digest"].isin([*curves])].to_dict("records"):
        missing = f"{run['method']} on {run['graph']} with seed {run['seed']}"
        remedy = "delete its row from sweep.csv, and it is written again"
        raise InputError(f"curves.csv has no learning curve of {missing}; {remedy}")
    return [curves[digest] for digest in runs["digest"]]


def _mean(values: np.ndarray | pd.Series, name: str) -> dict[str, float]:
    mean, half_width = mean_and_interval(np.asarray(values))
    return {name: float(mean), f"{name}_half_width": float(half_width)}


def _steps_to(percent: float, curves: Sequence[pd.DataFrame]) -> tuple[float, float, float]:
    points = [curve[["steps", "success_rate"]].to_numpy().T for curve in curves]
    reached = [first_crossing(steps, success, percent / 100) for steps, success in points]
    return median(reached), min(reached), max(reached)
