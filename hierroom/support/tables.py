"""Tables: on terminals of any width, and as CSV, Markdown and HTML."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from hierroom.support.cells import plain_cell

if TYPE_CHECKING:  # slow to load, and few programs print tables
    import pandas as pd
    from rich.console import Console
    from rich.table import Table

_WIDEST = 10_000  # characters, wider than any table


def print_table(table: Table, console: Console | None = None) -> None:
    """Print a table without folding columns that are aligned right or ``no_wrap``; lines may be too long for it."""
    from rich import get_console
    from rich.cells import cell_len
    from rich.measure import Measurement
    from rich.text import Text

    console = console or get_console()
    for column in table.columns:
        if column.justify == "right" or column.no_wrap:
            texts = [*column.cells, column.header] if column.no_wrap else [*column.cells]
            lines = [line for text in texts for line in Text.from_markup(str(text)).plain.splitlines()]
            column.min_width = max(map(cell_len, lines), default=0)
    least = Measurement.get(console, console.options.update(width=_WIDEST), table).minimum
    if least > console.width:
        table.width = least
    console.print(table, crop=False)


def named_table(headings: Sequence[str], rows: Iterable[Sequence[str]], n_names: int = 1, **layout: Any) -> Table:
    """Return a table for `print_table`: the first ``n_names`` columns are names, which may fold, the others numbers."""
    from rich.box import SIMPLE_HEAD
    from rich.markup import escape
    from rich.table import Table

    table = Table(**{"box": SIMPLE_HEAD, "padding": (0, 1, 0, 0), "caption_justify": "left", **layout})
    for n, heading in enumerate(headings):
        is_name = n < n_names
        table.add_column(heading, justify="left" if is_name else "right", overflow="fold", no_wrap=not is_name)
    for row in rows:
        table.add_row(*map(escape, row))
    return table


def csv_text(rows: Iterable[Mapping[str, Any]], columns: Sequence[str] | None = None) -> str:
    """Return rows as CSV with headings, in full precision; None, NaN and missing keys are empty cells."""
    import pandas as pd

    plain = [{name: plain_cell(one) for name, one in row.items()} for row in rows]
    return pd.DataFrame(plain, columns=columns, dtype=object).to_csv(index=False, lineterminator="\n")


def telling_columns(table: pd.DataFrame) -> list[str]:
    """Return the columns that distinguish a table's rows: each one distinguishes rows that those before it do not."""
    kept: list[str] = []
    n_kinds = 1
    for name in table.columns:
        if (n_finer := len(table[[*kept, name]].drop_duplicates())) > n_kinds:
            kept, n_kinds = [*kept, name], n_finer
    return kept


def markdown_table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table. The first column, and those where a cell begins with a letter, are aligned left."""
    lines = [[cell.replace("|", r"\|") for cell in cells] for cells in (headings, *rows)]
    columns = [column[1:] for column in zip(*lines, strict=True)]
    of_words = [n == 0 or any(cell[:1].isalpha() for cell in cells) for n, cells in enumerate(columns)]
    rule = "".join("|---" if is_of_words else "|---:" for is_of_words in of_words) + "|"
    head, *body = (f"| {' | '.join(cells)} |" for cells in lines)
    return "\n".join([head, rule, *body])


def html_table(caption: str, header: Sequence[str], rows: Iterable[Sequence[str]], notes: Iterable[str] = ()) -> str:
    """Return a table in HTML, with which notebooks show reports; ``header`` may be empty."""
    head = "".join(f"<th>{escape(name)}</th>" for name in header)
    body = "".join(
        f"<tr><th style='text-align: left'>{escape(name)}</th>"
        f"{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"
        for name, *cells in rows
    )
    top = f"<thead><tr>{head}</tr></thead>" if header else ""
    below = "".join(f"<p>{escape(note)}</p>" for note in notes)
    return f"<table><caption>{escape(caption)}</caption>{top}<tbody>{body}</tbody></table>{below}"
