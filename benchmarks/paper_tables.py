"""The paper's Table 3 next to ours, as it stands in the docs and in a CSV file."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

from benchmarks.committed import ROOT, done_rows
from benchmarks.paper.cells import Curves, table_3
from benchmarks.paper.order import pair_counts, prediction
from benchmarks.paper.published import METHODS
from benchmarks.paper.runs import PaperRuns
from benchmarks.paper.table3 import Compared
from hierroom.support.tables import markdown_table

if TYPE_CHECKING:
    import pandas as pd

PAPER = Path("benchmarks", "results", "paper")


def paper_table(size: str, n_seeds: str) -> str:
    """Return the success of the paper's Table 3 next to ours, how often they agree, and the command that prints it.

    Args:
        size: of the grid.
        n_seeds: how many seeds.

    Raises:
        InputError: if a run of it is not done.
    """
    cells, rows, curves = _paper_cells(size, n_seeds)
    counts = {f"by {one}": pair_counts(cells, one) for one in ("success", "length")}
    for method, own in Compared.of_rows(cells, rows, curves).reached.items():
        counts[f"by success where our {METHODS[method]} first has the paper's"] = pair_counts(own, "success")
    headings = ("pairs of methods on a graph", "in the paper's order", "opposite", "no significant difference")
    pairs = markdown_table(headings, [(name, *map(str, count)) for name, count in counts.items()])
    correlations = fill(prediction(cells), 130)
    command = f"python -m benchmarks.paper table3 --sizes {size} --seeds {n_seeds} --out {PAPER}"
    return f"\n`{command}` prints these among others:\n\n{_success_lines(cells)}\n\n{pairs}\n\n{correlations}\n\n"


def _success_lines(cells: pd.DataFrame) -> str:
    """Return two rows for each method: the paper's success, and ours ± half its 95% interval."""
    rows = []
    for method, own in cells.groupby("method", sort=False):
        numbers = own[["success", "success_half_width"]].itertuples(index=False, name=None)
        ours = (f"{value:.1f}" + ("" if math.isnan(half) else f" ± {half:.1f}") for value, half in numbers)
        theirs = (f"{value:.1f}" for value in own["paper_success"])
        rows += [[METHODS[str(method)], "paper", *theirs], ["", "ours", *ours]]
    return markdown_table(["success", "", *cells["graph"].unique()], rows)


def cells_table(size: str, n_seeds: str) -> str:
    """Return every number of the paper's Table 3 and of ours, as `benchmarks.paper table3 --csv` prints them.

    Args:
        size: of the grid.
        n_seeds: how many seeds.

    Raises:
        InputError: if a run of it is not done.
    """
    cells, *_ = _paper_cells(size, n_seeds)
    headings, *rows = csv.reader(io.StringIO(cells.to_csv(index=False)))
    return markdown_table(headings, rows)


def _paper_cells(size: str, n_seeds: str) -> tuple[pd.DataFrame, pd.DataFrame, Curves]:
    """Return the cells of a grid's Table 3, and the rows and learning curves they are made of."""
    paper = PaperRuns(ROOT / PAPER, seeds=int(n_seeds), sizes=(int(size),))
    sweep = paper.sweep(paper.graphs, METHODS)
    rows, curves = done_rows("paper", sweep.plan.runs()), sweep.table.curves()
    return table_3(rows, curves, paper.sizes), rows, curves
