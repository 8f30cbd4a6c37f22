"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def markdown_table(headings: Sequence[str], rows: Iterable[Sequence[str]], n_names: int = 1) -> str:
    """Rows of cells under their headings, without a line break at the end.

    Args:
        headings: one for each column.
        rows: the texts of each row's cells.
        n_names: how many columns, the first ones, stand on the left; all others, of numbers for the most part, on the
            right.
    """
    rule = "|---" * n_names + "|---:" * (len(headings) - n_names) + "|"
    escaped = [[cell.replace("|", r"\|") for cell in cells] for cells in (headings, *rows)]
    lines = [f"| {' | '.join(cells)} |" for cells in escaped]
    return "\n".join([lines[0], rule, *lines[1:]])
