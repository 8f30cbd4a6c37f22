"""The paper's tables and figures, ours printed beside its own numbers."""

from __future__ import annotations

import csv
import sys
from dataclasses import dataclass
from typing import Annotated

import tyro

from hierroom.cli import run
from hierroom.complexity.table2 import WHAT_IS_OPEN, Cell, table_2


@dataclass(frozen=True)
class Table2:
    """Depth, width and hitting times of the seven environments (Table 2)."""

    csv: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Print one line per number as CSV, ours unrounded."""

    def run(self) -> None:
        """Print the table."""
        cells = table_2()
        if self.csv:
            writer = csv.writer(sys.stdout, lineterminator="\n")
            writer.writerow(["row", "graph", "paper", "ours", "agrees"])
            writer.writerows([cell.row, cell.graph, cell.paper, cell.ours, cell.agrees] for cell in cells)
        else:
            _print_beside(cells)


COMMANDS = {"table2": Table2}
"""The sub-commands; what each prints is in the docstring of its class."""


def main() -> int:
    """The command."""
    description = "The paper's tables and figures, ours printed beside its own numbers."
    tyro.extras.subcommand_cli_from_dict(COMMANDS, prog="python -m hierroom.paper", description=description).run()
    return 0


def _print_beside(cells: list[Cell]) -> None:
    from rich.console import Console
    from rich.table import Table

    graphs = list(dict.fromkeys(cell.graph for cell in cells))
    table = Table(title="Table 2", caption="* differs from the paper's printed digits", caption_justify="left")
    for heading in ("", "", *(f"({graph}) " for graph in graphs)):
        table.add_column(heading, justify="right" if heading else "left", no_wrap=True)
    for row in dict.fromkeys(cell.row for cell in cells):
        in_row = [cell for cell in cells if cell.row == row]
        table.add_row(row, "paper", *(f"{cell.paper} " for cell in in_row))
        table.add_row("", "ours", *(_ours(cell) for cell in in_row), end_section=True)
    console = Console()
    console.print(table)
    agreeing = sum(cell.agrees for cell in cells)
    console.print(f"{agreeing} of {len(cells)} numbers agree to the printed digit. {WHAT_IS_OPEN}")


def _ours(cell: Cell) -> str:
    text = f"{cell.ours:.0f}" if isinstance(cell.paper, int) else f"{cell.ours:.1f}"
    return f"{text} " if cell.agrees else f"[yellow]{text}*[/yellow]"


if __name__ == "__main__":
    run(main)
