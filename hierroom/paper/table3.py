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

from hierroom.complexity.tables import markdown_table
from hierroom.errors import InputError
from hierroom.paper.cells import ComparedCell, table_3
from hierroom.paper.order import LEGEND, method_orders, pair_counts
from hierroom.paper.published import METHODS
from hierroom.paper.runs import PaperRuns
from hierroom.sweep.summary import steps_text

STEPS_TO_PAPER = "training steps until the paper's success rate"
STEPS_LEGEND = "median of the seeds; 0: before training; -: not reached; empty: the paper's is zero"


@dataclass(frozen=True)
class Table3:
    """Success and episode length of four methods (Table 3), ours beside the paper's; trains what is missing."""

    runs: tyro.conf.OmitArgPrefixes[PaperRuns]
    csv: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Print one line per cell as CSV."""
    markdown: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Print the tables in Markdown."""

    def __post_init__(self) -> None:
        if self.csv and self.markdown:
            raise InputError("the table is printed as CSV or in Markdown: give --csv or --markdown, not both")

    def run(self) -> None:
        """Train, and print the table and the order of the methods."""
        sweep = self.runs.train("abcdefg")
        cells = table_3(sweep.rows(), sweep.table.curves(), self.runs.sizes)
        if self.csv:
            writer = csv.DictWriter(sys.stdout, list(vars(cells[0])), lineterminator="\n")
            writer.writeheader()
            writer.writerows(vars(one) for one in cells)
            return
        for size in self.runs.sizes:
            own = [one for one in cells if one.size == size]
            if self.markdown:
                print(markdown(own))
                continue
            title = f"Table 3, ours after {self.runs.steps / 1e6:g}M steps on grids of {size}"
            console = Console()
            console.print(_drawn(title, _caption(own), _headings(own), _lines(own)))
            console.print(_drawn(f"Our {STEPS_TO_PAPER}", STEPS_LEGEND, _headings(own)[1:], _steps_lines(own)))
            console.print(_drawn("The order of the methods by success", LEGEND, ("", "", "methods"), _order_lines(own)))
            console.print(_sentences(own), highlight=False)


def markdown(cells: Sequence[ComparedCell]) -> str:
    """The table, the order of the methods, and how often it is the paper's, in Markdown.

    Args:
        cells: of one grid size.
    """
    numbers = markdown_table(_headings(cells), _lines(cells))
    orders = markdown_table(("", "", "methods"), _order_lines(cells))
    steps = markdown_table(_headings(cells)[1:], _steps_lines(cells))
    parts = [f"{_caption(cells)}:", numbers, f"our {STEPS_TO_PAPER} ({STEPS_LEGEND}):", steps]
    parts += [f"the order of the methods by success ({LEGEND}):", orders, _sentences(cells)]
    return "\n\n".join(part.strip() for part in parts)


def _caption(cells: Sequence[ComparedCell]) -> str:
    fewest = min(one.seeds for one in cells)
    told = "one seed" if fewest == 1 else f"means of {fewest} seeds and half the width of their 95% interval"
    return f"{told}; length in percent of 1000 steps"


def _headings(cells: Sequence[ComparedCell]) -> tuple[str, ...]:
    return ("", "", *(f"({graph})" for graph in dict.fromkeys(one.graph for one in cells)))


def _lines(cells: Sequence[ComparedCell]) -> list[tuple[str, ...]]:
    """Two lines, the paper's and ours, for each method, first of success and then of length."""
    lines = []
    for quantity in ("success", "length"):
        for method, name in METHODS.items():
            own = [one for one in cells if one.method == method]
            paper, ours, widths = (
                [getattr(one, column) for one in own]
                for column in (f"paper_{quantity}", quantity, f"{quantity}_half_width")
            )
            printed = ["-" if value is None else f"{value:.1f}" for value in paper]
            lines += [(f"{name}, {quantity}", "paper", *printed), ("", "ours", *map(_with_width, ours, widths))]
    return lines


def _steps_lines(cells: Sequence[ComparedCell]) -> list[tuple[str, ...]]:
    by_method = {name: [one for one in cells if one.method == method] for method, name in METHODS.items()}
    return [(name, *(_steps(one.steps_to_paper) for one in own)) for name, own in by_method.items()]


def _steps(steps: float) -> str:
    if np.isnan(steps):
        return ""
    return "-" if np.isinf(steps) else steps_text(steps) if steps else "0"


def _order_lines(cells: Sequence[ComparedCell]) -> list[tuple[str, ...]]:
    lines = []
    for order in method_orders(cells, "success"):
        lines += [(f"({order.graph})", "paper", order.paper), ("", "ours", order.ours)]
    return lines


def _sentences(cells: Sequence[ComparedCell]) -> str:
    return " ".join(f"By {quantity}: {pair_counts(cells, quantity)}" for quantity in ("success", "length"))


def _drawn(title: str, caption: str, headings: Sequence[str], lines: Sequence[Sequence[str]]) -> Table:
    table = Table(title=title, caption=caption, caption_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in headings:
        table.add_column(heading, justify="right" if heading.startswith("(") else "left", no_wrap=True)
    for n, line in enumerate(lines):
        table.add_row(*line, end_section=headings[1] == "" and n % 2 == 1)
    return table


def _with_width(value: float, half_width: float) -> str:
    return f"{value:.1f}" if np.isnan(half_width) else f"{value:.1f}±{half_width:.1f}"
