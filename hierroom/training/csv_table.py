"""A table in a CSV file that grows row by row while training goes on."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from hierroom.errors import InputError
from hierroom.files import write_atomically


class CSVTable:
    """Rows of a CSV file, each of which begins with the number of steps trained before it was written.

    Args:
        path: the file; the first rows create it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def append(self, rows: Sequence[Mapping[str, object]]) -> None:
        """Append rows, all with the same columns; none write nothing.

        Raises:
            InputError: if they cannot be written; the previous rows are still there.
        """
        if not rows:
            return
        text = io.StringIO()
        writer = csv.DictWriter(text, list(rows[0]))
        size = self.path.stat().st_size if self.path.exists() else 0
        if size == 0:
            writer.writeheader()
        writer.writerows(rows)
        try:
            with self.path.open("a", newline="") as file:
                file.write(text.getvalue())
        except OSError as error:
            with suppress(OSError):
                os.truncate(self.path, size)
            raise InputError(f"cannot write {self.path}: {error.strerror}") from error

    def read(self) -> list[dict[str, str]]:
        """The rows as text by column, none where there is no file.

        Raises:
            InputError: if a row is too short or too long.
        """
        if not self.path.exists():
            return []
        with self.path.open(newline="") as file:
            rows = list(csv.DictReader(file))
        for number, row in enumerate(rows, start=2):
            if None in row or None in row.values():
                raise InputError(f"{self.path} is broken: line {number} has not as many entries as the first line")
        return rows

    def numbers(self) -> list[dict[str, float]]:
        """The rows as numbers by column.

        Raises:
            InputError: if a row is too short or too long, or an entry is not a number.
        """
        try:
            return [{name: float(text) for name, text in row.items()} for row in self.read()]
        except ValueError as error:
            raise InputError(f"{self.path} is broken: {error}") from error

    def drop_after(self, steps: int) -> None:
        """Delete the rows of more steps than these, which a resumed run writes again.

        Raises:
            InputError: if a row is broken.
        """
        rows = self.read()
        try:
            kept = [int(float(row["steps"])) <= steps for row in rows]
        except (KeyError, ValueError) as error:
            raise InputError(f"{self.path} is broken: {error}") from error
        if rows and not all(kept):
            header, *lines = self.path.read_bytes().splitlines(keepends=True)
            write_atomically(
                self.path, b"".join([header, *(line for line, keep in zip(lines, kept, strict=True) if keep)])
            )
