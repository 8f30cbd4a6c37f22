"""Tables of what benchmarks measured and no sweep trained, kept as CSV in `benchmarks/results/`."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically
from hierroom.support.tables import markdown_table


@dataclass(frozen=True)
class ResultTable:
    """Numbers as they are shown.

    Args:
        headings: one for each column.
        rows: the texts of each row's cells.
    """

    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    @classmethod
    def read(cls, path: Path) -> ResultTable:
        """Return the table in a file that `publish` wrote.

        Raises:
            InputError: if there is none.
        """
        try:
            lines = [*csv.reader(io.StringIO(path.read_text(encoding="utf-8-sig"), newline=""))]
        except FileNotFoundError:
            lines = []
        if not lines:
            raise InputError(f"there is no table {path}; the benchmark that measures it writes it with --out")
        headings, *rows = map(tuple, lines)
        return cls(headings, tuple(rows))

    def markdown(self) -> str:
        """For a page."""
        return markdown_table(self.headings, self.rows)

    def publish(self, out: Path | None) -> None:
        """Print the table in Markdown.

        Args:
            out: a file that it is written to as CSV, too.
        """
        print(self.markdown())
        if out is not None:
            write_atomically(out, csv_of(self.headings, self.rows).encode())


def csv_of(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table as CSV."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([headings, *rows])
    return text.getvalue()
