"""Tables in plain text, as reports are printed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def text_table(head: str, header: Sequence[str], rows: Sequence[Sequence[str]], notes: Iterable[str] = ()) -> str:
    """A table: names to the left, numbers to the right, and intervals to the left beside their numbers.

    Args:
        head: the line above.
        header: names of the columns; one that ends in "interval" holds intervals.
        rows: the texts of each line's cells, the name first.
        notes: lines below it.
    """
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
