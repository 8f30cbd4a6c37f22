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
        self._names: list[str] | None = None

    def append(self, rows: Sequence[Mapping[str, object]]) -> None:
        """Append rows; an entry that one lacks is NaN, and none write nothing. What a crash left of a row is dropped.

        Raises:
            InputError: if a row has an entry that the first row had not, or they cannot be written; the previous rows
                are still there.
        """
        if not rows:
            return
        text, size = io.StringIO(), self.path.stat().st_size if self.path.exists() else 0
        if self._names is None:  # the first time, as the file may be long
            whole = self._whole_lines()
            self._names = next(csv.reader(whole.decode().splitlines())) if whole else list(rows[0])
            if len(whole) < size:
                os.truncate(self.path, size := len(whole))
        unknown = dict.fromkeys(name for row in rows for name in row if name not in self._names)
        if unknown:
            raise InputError(f"{self.path} has the columns of its first row, and no {', '.join(unknown)}")
        writer = csv.DictWriter(text, self._names, restval="nan")
        if size == 0:
            writer.writeheader()
        writer.writerows(rows)
        try:
            with self.path.open("ab") as file:
                file.write(text.getvalue().encode())
        except OSError as error:
            with suppress(OSError):
                os.truncate(self.path, size)
            raise InputError(f"cannot write {self.path}: {error.strerror}") from error

    def _whole_lines(self) -> bytes:
        """What the file holds, without a last line that a crash left unfinished."""
        content = self.path.read_bytes() if self.path.is_file() else b""
        return content[: content.rfind(b"\n") + 1]

    def read(self) -> list[dict[str, str]]:
        """The rows as text by column, none where there is no file.

        Raises:
            InputError: if a row is too short or too long.
        """
        rows = list(csv.DictReader(io.StringIO(self._whole_lines().decode(), newline="")))
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
            header, *lines = self._whole_lines().splitlines(keepends=True)
            write_atomically(
                self.path, b"".join([header, *(line for line, keep in zip(lines, kept, strict=True) if keep)])
            )
