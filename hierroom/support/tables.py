"""Tables: on terminals of any width, and as CSV, Markdown, LaTeX, HTML and plain text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # each takes its time to load, and few programs print tables
    import pandas as pd
    from rich.console import Console
    from rich.table import Table

_WIDEST = 10_000
"""Characters, more than any table takes."""
_TEX = {"∞": r"$\infty$", " +- ": r" $\pm$ ", "<": r"\textless{}", ">": r"\textgreater{}", "|": r"\textbar{}"}
"""What pandas does not escape."""


def print_table(table: Table, console: Console | None = None) -> None:
    """Print a table whose numbers are whole: where the terminal is too narrow, lines run beyond it.

    Args:
        table: columns that are justified to the right are numbers, which are never folded; nor are columns with
            ``no_wrap``, and their headings.
        console: where it is printed; None: standard output.
    """
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
    """Return a table for `print_table`: the first ``n_names`` columns are names, which fold, the others numbers."""
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
    """Rows as CSV with a line of headings, in full precision; None and NaN are empty cells.

    Args:
        rows: their keys are the columns; a row may lack some.
        columns: the columns where there may be no row.
    """
    import pandas as pd

    return pd.DataFrame([*rows], columns=columns, dtype=object).to_csv(index=False, lineterminator="\n")


def telling_columns(table: pd.DataFrame) -> list[str]:
    """The columns that tell the rows of a table apart: one by one, each that tells more apart than those before it."""
    kept: list[str] = []
    n_kinds = 1
    for name in table.columns:
        if (n_finer := len(table[[*kept, name]].drop_duplicates())) > n_kinds:
            kept, n_kinds = [*kept, name], n_finer
    return kept


def markdown_table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Rows of cells under their headings in Markdown, without a line break at the end.

    The first column is aligned left, and so is every other with a cell that begins with a letter; numbers are aligned
    right.
    """
    lines = [[cell.replace("|", r"\|") for cell in cells] for cells in (headings, *rows)]
    columns = [column[1:] for column in zip(*lines, strict=True)]
    of_words = [n == 0 or any(cell[:1].isalpha() for cell in cells) for n, cells in enumerate(columns)]
    rule = "".join("|---" if is_of_words else "|---:" for is_of_words in of_words) + "|"
    head, *body = (f"| {' | '.join(cells)} |" for cells in lines)
    return "\n".join([head, rule, *body])


def latex_table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A LaTeX tabular for the package booktabs, names on the left, without a line break at the end."""
    import pandas as pd

    frame = pd.DataFrame([*rows], columns=[*headings]).replace("inf", "∞")
    text = frame.to_latex(index=False, escape=True, column_format="l" + "r" * (len(headings) - 1))
    for plain, tex in _TEX.items():
        text = text.replace(plain, tex)
    return text.rstrip()


def html_table(caption: str, header: Sequence[str], rows: Iterable[Sequence[str]], notes: Iterable[str] = ()) -> str:
    """A table in HTML, as notebooks show reports: the caption above, notes below; ``header`` may be empty."""
    head = "".join(f"<th>{escape(name)}</th>" for name in header)
    body = "".join(
        f"<tr><th style='text-align: left'>{escape(name)}</th>"
        f"{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"
        for name, *cells in rows
    )
    top = f"<thead><tr>{head}</tr></thead>" if header else ""
    below = "".join(f"<p>{escape(note)}</p>" for note in notes)
    return f"<table><caption>{escape(caption)}</caption>{top}<tbody>{body}</tbody></table>{below}"


def text_table(head: str, header: Sequence[str], rows: Sequence[Sequence[str]], notes: Iterable[str] = ()) -> str:
    """A table in plain text: names and columns called "... interval" on the left, numbers on the right."""
    lines = [header, *rows]
    widths = [max(map(len, cells)) for cells in zip(*lines, strict=True)]
    is_left = [i == 0 or name.endswith("interval") for i, name in enumerate(header)]
    texts = [
        "   ".join(
            f"{cell:<{width}}" if left else f"{cell:>{width}}"
            for cell, width, left in zip(line, widths, is_left, strict=True)
        ).rstrip()
        for line in lines
    ]
    return "\n".join([head, *(f"  {text}" for text in [*texts, *notes])])
