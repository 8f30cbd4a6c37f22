"""Tables on terminals of any width."""

from __future__ import annotations

from rich.cells import cell_len
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

_WIDEST = 10_000
"""Characters, more than any table takes."""


def print_table(table: Table, console: Console | None = None) -> None:
    """Print a table whose numbers are whole: where the terminal is too narrow, lines run beyond it.

    Args:
        table: whose columns of numbers are justified to the right, and whose columns of names that are not to be folded
            are not wrapped; the longest cell of each is the least width of its column, and of one that is not wrapped
            its heading, too.
        console: where it is printed; None: standard output.
    """
    console = console or Console()
    for column in table.columns:
        if column.justify == "right" or column.no_wrap:
            texts = [*column.cells, column.header] if column.no_wrap else [*column.cells]
            lines = [line for text in texts for line in Text.from_markup(str(text)).plain.splitlines()]
            column.min_width = max(map(cell_len, lines), default=0)
    least = Measurement.get(console, console.options.update(width=_WIDEST), table).minimum
    if least > console.width:
        table.width = least
    console.print(table, crop=False)
