"""A table in a CSV file that grows row by row while training goes on, and outlives a crash at any moment."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Never

from hierroom.support.errors import InputError, shown
from hierroom.support.files import append_whole, sync, truncate, write_atomically

_FIRST = "steps"


class CSVTable:
    """Rows of a CSV file, each of which begins with its ``steps``; a resumed run calls `keep` before it appends."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._names: list[str] = []
        self._n_rows: int | None = None  # unknown until it is counted, as the file may be long

    @property
    def n_rows(self) -> int:
        """The number of rows, for a checkpoint."""
        if self._n_rows is None:
            self.keep()
        return self._n_rows or 0

    def keep(self, n_rows: float = math.inf, steps: float = math.inf) -> int:
        """Keep the first ``n_rows`` rows, each up to ``steps``, delete the rest, and return how many rows there are."""
        names, n_kept, end = [], 0, 0
        for place, entries in self._rows(steps) if n_rows else ():
            n_kept += bool(names)
            names, end = names or entries, place
            if n_kept == n_rows:
                break
        if self.path.exists() and self.path.stat().st_size > end:
            truncate(self.path, end)
        self._names, self._n_rows = names, n_kept
        return n_kept

    def append(self, rows: Sequence[Mapping[str, object]]) -> None:
        """Append rows. An entry that a row lacks is NaN; a new entry makes a column, with NaN in all earlier rows."""
        if not rows:
            return
        n_rows, entries = self.n_rows, dict.fromkeys(name for row in rows for name in row)
        added = [name for name in entries if name not in self._names]
        if self._names and added:
            self._widen(added)
        self._names = names = [*self._names, *added]
        lines = b"".join(_line([row.get(name, "nan") for name in names]) for row in rows)
        if not self.path.exists() or self.path.stat().st_size == 0:
            n_rows, lines = 0, _line(names) + lines
        append_whole(self.path, lines)
        self._n_rows = n_rows + len(rows)

    def _widen(self, added: list[str]) -> None:
        lines = (
            _line([*entries, *(["nan"] * len(added) if n else added)]) for n, (_, entries) in enumerate(self._rows())
        )
        write_atomically(self.path, lines)

    def sync(self) -> None:
        """Have the rows outlive a loss of power."""
        sync(self.path)

    def read(self) -> list[dict[str, str]]:
        """Return the rows as text by column, none where there is no file."""
        rows = (entries for _, entries in self._rows())
        names = next(rows, [])
        return [dict(zip(names, row, strict=True)) for row in rows]

    def numbers(self) -> list[dict[str, float]]:
        """Return the rows as numbers by column."""
        try:
            return [{name: float(text) for name, text in row.items()} for row in self.read()]
        except ValueError as error:
            raise InputError(f"{self.path} is broken: {error}") from error

    def _rows(self, most: float = math.inf) -> Iterator[tuple[int, list[str]]]:
        """Yield the names of the columns, then the entries of each row, with the place in the file after them."""
        allowed = "a number of steps" + (f" up to {most:,}" if most < math.inf else "")
        end, n_columns, torn = 0, 0, 0
        try:
            with suppress(FileNotFoundError), self.path.open("rb") as file:
                for number, line in enumerate(file, start=1):
                    end += len(line)
                    if not line.strip():  # a crash leaves such lines too
                        continue
                    if not line.endswith(b"\n") or b"\0" in line:  # a crash leaves that at the end
                        torn = torn or number
                        continue
                    entries = _entries(line)
                    if torn or entries is None:
                        self._refuse(torn or number, "is no row of text")
                    if not n_columns and (entries[0] != _FIRST or len({*entries}) < len(entries)):
                        self._refuse(number, "does not name the columns")
                    if n_columns and len(entries) != n_columns:
                        self._refuse(number, "has not as many entries as the line that names them")
                    if n_columns and not 0 <= _steps(entries) <= most:
                        self._refuse(number, f"begins with {shown(entries[0])}, not with {allowed}")
                    n_columns = len(entries)
                    yield end, entries
        except OSError as error:
            raise InputError(f"cannot read {self.path}: {error.strerror}") from error

    def _refuse(self, number: int, why: str) -> Never:
        raise InputError(f"{self.path} is broken: line {number} {why}")


def _line(entries: Sequence[object]) -> bytes:
    text = io.StringIO()
    csv.writer(text).writerow([" ".join(entry.splitlines()) if isinstance(entry, str) else entry for entry in entries])
    return text.getvalue().encode(errors="backslashreplace")


def _entries(line: bytes) -> list[str] | None:
    try:
        return next(csv.reader([line.decode()], strict=True))
    except (UnicodeDecodeError, csv.Error):
        return None


def _steps(entries: Sequence[str]) -> int:
    """Return the steps that a row begins with; -1 if it begins with something else."""
    try:
        return int(float(entries[0]))
    except (ValueError, OverflowError):
        return -1
