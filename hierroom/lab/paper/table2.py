"""Table 2: depth, width and hitting times of the seven environments."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Annotated

import tyro

from hierroom.complexity.report import analyze
from hierroom.complexity.walk import TABLE_READING, Reading
from hierroom.goals import NAMED_GRAPHS
from hierroom.lab.paper.published import PAPER_TABLE_2
from hierroom.support.errors import InputError
from hierroom.support.tables import csv_text, markdown_table, print_table

WHAT_IS_OPEN = (
    "Graphs d, e and f differ from the paper in both hitting-time (HT) rows. The paper prints the augmented graph of "
    "c only, and no reading of its text that we tried gives all fourteen numbers. The one used here gives a, b, c and "
    "g in both rows; nothing is tuned to make d, e and f agree."
)


@dataclass(frozen=True)
class TableCell:
    """One value of the table: the paper's and ours."""

    row: str
    graph: str
    paper: float
    ours: float

    @property
    def agrees(self) -> bool:
        """Whether our value, rounded as in the paper, equals the printed one."""
        return round(self.ours, 1) == self.paper


def table_2(reading: Reading = TABLE_READING) -> list[TableCell]:
    """Compute every value of Table 2: exit depth, width, hitting time without and with drop, for the graphs a to g."""
    cells = []
    for letter, printed in PAPER_TABLE_2.items():
        graph = NAMED_GRAPHS[letter]
        plain, dropping = analyze(graph, False, reading=reading), analyze(graph, True, reading=reading)
        cells += [
            TableCell("exit depth", letter, printed.exit_depth, plain.exit_depth),
            TableCell("graph width", letter, printed.width, plain.width),
            TableCell("HT, no drop", letter, printed.hitting_time, plain.hitting_time),
            TableCell("HT, with drop", letter, printed.hitting_time_drop, dropping.hitting_time),
        ]
    return cells


@dataclass(frozen=True)
class Table2:
    """Depth, width and hitting times of the seven environments (Table 2)."""

    csv: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Print one line per number as CSV, ours unrounded."""
    markdown: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Print the table in Markdown."""

    def run(self) -> None:
        """Print the table."""
        if self.csv and self.markdown:
            raise InputError("--csv and --markdown are both given; give one of them")
        cells = table_2()
        if self.markdown:
            headings = ["", "", *dict.fromkeys(f"({cell.graph})" for cell in cells)]
            print(markdown_table(headings, [[cell.strip() for cell in line] for line in _lines(cells)]))
        elif self.csv:
            print(csv_text({**asdict(cell), "agrees": cell.agrees} for cell in cells), end="")
        else:
            _print_beside(cells)


def _print_beside(cells: list[TableCell]) -> None:
    from rich.console import Console
    from rich.table import Table

    graphs = list(dict.fromkeys(cell.graph for cell in cells))
    table = Table(title="Table 2", caption="* differs from the paper's printed digits", caption_justify="left")
    for heading in ("", "", *(f"({graph}) " for graph in graphs)):
        table.add_column(heading, justify="right" if heading else "left", no_wrap=True)
    for line in _lines(cells):
        cells_of_line = (f"[yellow]{cell}[/yellow]" if cell.endswith("*") else cell for cell in line)
        table.add_row(*cells_of_line, end_section=line[1] == "ours")
    console = Console()
    print_table(table, console)
    agreeing = sum(cell.agrees for cell in cells)
    console.print(f"{agreeing} of {len(cells)} numbers agree to the printed digit. {WHAT_IS_OPEN}")


def _lines(cells: list[TableCell]) -> list[list[str]]:
    """The paper's numbers of each row and, below them, ours; what differs ends in a star."""
    lines = []
    for row in dict.fromkeys(cell.row for cell in cells):
        in_row = [cell for cell in cells if cell.row == row]
        lines.append([row, "paper", *(f"{cell.paper} " for cell in in_row)])
        lines.append(["", "ours", *(_ours(cell) for cell in in_row)])
    return lines


def _ours(cell: TableCell) -> str:
    text = f"{cell.ours:.0f}" if isinstance(cell.paper, int) else f"{cell.ours:.1f}"
    return f"{text} " if cell.agrees else f"{text}*"
