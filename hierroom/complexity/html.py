"""Tables in HTML, as notebooks show reports."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape


def html_table(caption: str, header: Sequence[str], rows: Iterable[Sequence[str]], notes: Iterable[str] = ()) -> str:
    """A table.

    Args:
        caption: what it is of, written above.
        header: names of the columns, or nothing.
        rows: the texts of each line's cells.
        notes: lines below it.
    """
    head = "".join(f"<th>{escape(name)}</th>" for name in header)
    body = "".join(
        f"<tr><th style='text-align: left'>{escape(name)}</th>"
        f"{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"
        for name, *cells in rows
    )
    top = f"<thead><tr>{head}</tr></thead>" if header else ""
    below = "".join(f"<p>{escape(note)}</p>" for note in notes)
    return f"<table><caption>{escape(caption)}</caption>{top}<tbody>{body}</tbody></table>{below}"
