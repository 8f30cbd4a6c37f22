"""Table 3: success and episode length of four methods on the seven environments."""

from __future__ import annotations

import csv
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import tyro
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from hierroom.paper.published import METHODS, PAPER_TABLE_3
from hierroom.paper.runs import PaperRuns, cell, mean_and_interval
from hierroom.sweep.table import Row

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


def table_3(rows: Sequence[Row], sizes: Sequence[int]) -> list[ComparedCell]:
    """Our numbers beside the paper's, of all that was trained."""
    cells = []
    for size in sizes:
        for (method, graph), printed in PAPER_TABLE_3.items():
            runs = cell(rows, method, graph, size)
            if runs:
                success, length = (np.array([float(row[name]) for row in runs]) for name in ("success_rate", "length"))
                ours: dict[str, float] = {}
                for name, values in (("success", 100 * success), ("length", 100 * length / LIMIT)):
                    ours[name], ours[f"{name}_half_width"] = map(float, mean_and_interval(values))
                paper = {"paper_success": printed.success, "paper_length": printed.length}
                cells.append(ComparedCell(method, graph, size, len(runs), **paper, **ours))
    return cells


@dataclass(frozen=True)
class Table3:
    """Success and episode length of four methods (Table 3), ours beside the paper's; trains what is missing."""

    runs: tyro.conf.OmitArgPrefixes[PaperRuns]
    csv: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Print one line per cell as CSV."""

    def run(self) -> None:
        """Train, and print the table."""
        sweep = self.runs.train("abcdefg")
        cells = table_3(sweep.rows(), self.runs.sizes)
        if self.csv:
            writer = csv.DictWriter(sys.stdout, list(vars(cells[0])), lineterminator="\n")
            writer.writeheader()
            writer.writerows(vars(one) for one in cells)
            return
        for size in self.runs.sizes:
            own = [one for one in cells if one.size == size]
            Console().print(_printed(own, size, self.runs.steps))


def _printed(cells: Sequence[ComparedCell], size: int, steps: int) -> Table:
    graphs = [graph for graph in "abcdefg" if any(one.graph == graph for one in cells)]
    fewest = min(one.seeds for one in cells)
    told = "one seed" if fewest == 1 else f"means of {fewest} seeds and half the width of their 95% interval"
    table = Table(
        title=f"Table 3, ours after {steps / 1e6:g}M steps on grids of {size}",
        caption=f"{told}; length in percent of 1000 steps",
        caption_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    for heading in ("", "", *(f"({graph})" for graph in graphs)):
        table.add_column(heading, justify="right" if heading else "left", no_wrap=True)
    for quantity in ("success", "length"):
        for method, name in METHODS.items():
            own = {one.graph: one for one in cells if one.method == method}
            if not own:
                continue
            paper, ours, widths = (
                [getattr(own[graph], column) for graph in graphs]
                for column in (f"paper_{quantity}", quantity, f"{quantity}_half_width")
            )
            printed = ["-" if value is None else f"{value:.1f}" for value in paper]
            table.add_row(f"{name}, {quantity}", "paper", *printed)
            table.add_row("", "ours", *map(_with_width, ours, widths), end_section=True)
    return table


def _with_width(value: float, half_width: float) -> str:
    return f"{value:.1f}" if np.isnan(half_width) else f"{value:.1f}±{half_width:.1f}"
