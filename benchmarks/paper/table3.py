"""Table 3: success and episode length of four methods on the seven environments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import accumulate
from typing import TYPE_CHECKING

import numpy as np
import tyro
from rich.console import Console

from benchmarks.paper.cells import REFERENCES, STEPS_ENDS, Curves, cells_where_reached, table_3
from benchmarks.paper.order import LEGEND, method_orders, pair_counts, prediction
from benchmarks.paper.published import METHODS
from benchmarks.paper.runs import PaperRuns
from hierroom.lab.sweep.summary import steps_text
from hierroom.support.cli import Flag
from hierroom.support.errors import InputError
from hierroom.support.tables import markdown_table, named_table, print_table

if TYPE_CHECKING:
    import pandas as pd
    from rich.table import Table


@dataclass(frozen=True)
class Table3:
    """Print success and episode length of four methods (Table 3), with the paper's; train missing runs first."""

    runs: tyro.conf.OmitArgPrefixes[PaperRuns]
    csv: Flag = False
    """Print one line per cell as CSV: unknown values are empty, and inf means that half of the seeds never arrived."""
    markdown: Flag = False
    """Print the tables in Markdown."""

    def __post_init__(self) -> None:
        if self.csv and self.markdown:
            raise InputError("the table is printed as CSV or in Markdown: give --csv or --markdown, not both")

    def run(self) -> None:
        """Train, and print the table, the training steps to the paper's success, and the order of the methods."""
        sweep = self.runs.train("abcdefg")
        rows, curves = sweep.rows(), sweep.table.curves()
        cells = table_3(rows, curves, self.runs.sizes)
        if self.csv:
            print(cells.to_csv(index=False, lineterminator="\n"), end="")
            return
        for size in self.runs.sizes:
            compared = Compared.of_rows(cells[cells["size"] == size], rows, curves)
            if self.markdown:
                print(markdown(compared, self.runs.steps))
                continue
            for part in _parts(compared, self.runs.steps):
                print_table(part.drawn())
            Console().print(_sentences(compared), highlight=False)


@dataclass(frozen=True)
class Compared:
    """The numbers of one grid size."""

    cells: pd.DataFrame  # at the end of training
    reached: Mapping[str, pd.DataFrame]  # where each method of `REFERENCES` first reached the paper's success

    @classmethod
    def of_rows(cls, cells: pd.DataFrame, rows: pd.DataFrame, curves: Curves) -> Compared:
        """Compute the cells before the end of training from the sweep's rows and learning curves."""
        earlier = {method: cells_where_reached(cells, rows, curves, method) for method in REFERENCES}
        return cls(cells, {method: reached for method, reached in earlier.items() if len(reached)})


def markdown(compared: Compared, steps: int) -> str:
    """Return the table, the training steps to the paper's success, and the order of the methods, in Markdown."""
    return "\n\n".join([*(part.markdown() for part in _parts(compared, steps)), _sentences(compared)])


@dataclass(frozen=True)
class _Part:
    title: str
    legend: str  # how to read the table
    headings: tuple[str, ...]
    groups: list[list[tuple[str, ...]]]

    @property
    def lines(self) -> list[tuple[str, ...]]:
        return [line for group in self.groups for line in group]

    def drawn(self) -> Table:
        n_names = sum(not heading.startswith("(") for heading in self.headings)
        table = named_table(self.headings, self.lines, n_names, title=self.title, caption=self.legend)
        for column in table.columns:
            column.no_wrap = True
        for end in accumulate(map(len, self.groups)):
            table.rows[end - 1].end_section = True
        return table

    def markdown(self) -> str:
        return f"{self.title} ({self.legend}):\n\n{markdown_table(self.headings, self.lines)}"


def _parts(compared: Compared, steps: int) -> list[_Part]:
    cells = compared.cells
    fewest, size = cells["seeds"].min(), cells["size"].iloc[0]
    seeds = "one seed" if fewest == 1 else f"means of {fewest} seeds, and half the width of their 95% interval"
    numbers = [_compared(*own, quantity) for quantity in ("success", "length") for own in _by_method(cells)]
    lines = [_steps_lines(*own) for own in _by_method(cells)]
    orders = [
        [(f"({graph})", "paper", paper), ("", "ours", ours)] for graph, paper, ours in method_orders(cells, "success")
    ]
    title = f"Table 3, ours after {steps / 1e6:g}M steps on grids of {size}"
    never = "medians of the seeds, from the fastest to the slowest; 0: before training; -: not by half or more"
    never += "; empty: the paper's is below 1%"
    return [
        _Part(title, f"{seeds}; length in percent of 1000 steps", _headings("", cells), numbers),
        _Part("Our training steps until the paper's success, and until 95%", never, _headings("success", cells), lines),
        _Part("The order of the methods by success", LEGEND, ("", "", "methods"), orders),
        *(_part_where_reached(METHODS[method], own) for method, own in compared.reached.items()),
    ]


def _part_where_reached(reference: str, cells: pd.DataFrame) -> _Part:
    by_method = _by_method(cells)
    steps = ("our steps", "", *map(_steps, dict(by_method)[reference]["steps_to_paper"]))
    numbers = [_compared(*own, "success") for own in by_method]
    legend = f"after the steps that the median of our seeds of {reference} takes to it; the paper's are of its end"
    title = f"Success where our {reference} first has the paper's"
    return _Part(title, legend, _headings("", cells), [[steps], *numbers])


def _headings(second: str, cells: pd.DataFrame) -> tuple[str, ...]:
    return ("", second, *(f"({graph})" for graph in cells["graph"].unique()))


def _by_method(cells: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    return [(METHODS[str(method)], own) for method, own in cells.groupby("method", sort=False)]


def _compared(name: str, cells: pd.DataFrame, quantity: str) -> list[tuple[str, ...]]:
    def texts(column: str, unknown: str) -> list[str]:
        return [unknown if np.isnan(value) else f"{value:.1f}" for value in cells[column]]

    lines = [
        (f"{name}, {quantity}", "paper", *texts(f"paper_{quantity}", "-")),
        ("", "ours", *texts(quantity, "nan")),
        ("", "±", *texts(f"{quantity}_half_width", "")),
    ]
    return lines if any(lines[2][2:]) else lines[:2]


def _steps_lines(name: str, cells: pd.DataFrame) -> list[tuple[str, ...]]:
    ends = STEPS_ENDS if (cells["seeds"] > 1).any() else STEPS_ENDS[:1]
    lines = [
        ("", label, *map(_steps, cells[column + end]))
        for success, column in (("paper's", "steps_to_paper"), ("95%", "steps_to_95"))
        for label, end in zip((success, "from", "to"), ends, strict=False)
    ]
    return [(name, *lines[0][1:]), *lines[1:]]


def _steps(steps: float) -> str:
    if np.isnan(steps):
        return ""
    return "-" if np.isinf(steps) else steps_text(steps)


def _sentences(compared: Compared) -> str:
    counts = [f"By {quantity}: {pair_counts(compared.cells, quantity)}" for quantity in ("success", "length")]
    for method, own in compared.reached.items():
        counts.append(f"By success where {METHODS[method]} first has the paper's: {pair_counts(own, 'success')}")
    return " ".join([*counts, prediction(compared.cells)]).strip()
