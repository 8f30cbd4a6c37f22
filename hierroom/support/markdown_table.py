"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def markdown_table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Rows of cells under their headings, without a line break at the end.

    The first column stands on the left, and so does every other with a cell that begins with a letter; numbers stand on
    the right.

    Args:
        headings: one for each column.
        rows: the texts of each row's cells.
    """
    lines = [[cell.replace("|", r"\|") for cell in cells] for cells in (headings, *rows)]
    columns = [column[1:] for column in zip(*lines, strict=True)]
    of_words = [n == 0 or any(cell[:1].isalpha() for cell in cells) for n, cells in enumerate(columns)]
    rule = "".join("|---" if is_of_words else "|---:" for is_of_words in of_words) + "|"
    head, *body = (f"| {' | '.join(cells)} |" for cells in lines)
    return "\n".join([head, rule, *body])
