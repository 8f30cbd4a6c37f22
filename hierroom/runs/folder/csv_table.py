"""A table in a CSV file that grows by rows during training, and stays readable after a crash at any moment."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Never

from hierroom.support.cells import plain_cell, read_number, text_of_cell
from hierroom.support.errors import InputError, shown
from hierroom.support.files import MOST_TEXT, append_whole, open_regular, truncate, write_atomically

_FIRST = "steps"
_LONGEST, _LONGEST_CELL = 2**20, 2**16  # bytes of a line, characters of a text; csv.reader takes twice as many


class CSVTable:
    """Rows of a CSV file; each begins with its ``steps``. A resumed run calls `keep` before it appends.

    ``numbers`` gives columns that must exist, each with its least value, or None if its cells may be empty. If it is
    given, each cell outside the columns ``texts`` must be a number in the range of its column.
    """

    def __init__(
        self, path: Path, numbers: Mapping[str, float | None] | None = None, texts: Collection[str] = ()
    ) -> None:
        self.path = path
        self._numbers, self._texts = numbers, texts
        self._names: list[str] = []
        self._n_rows: int | None = None  # None until it is needed, as counting a long file takes time

    @property
    def n_rows(self) -> int:
        """The number of rows, for a checkpoint."""
        if self._n_rows is None:
            self.keep()
        return self._n_rows or 0

    def keep(self, n_rows: float = math.inf, steps: float = math.inf) -> int:
        """Keep the first ``n_rows`` rows, delete the rest, and return how many are left; refuse rows past ``steps``."""
        n_kept, end = self.measure(n_rows, steps)
        if self.path.exists() and self.path.stat().st_size > end:
            truncate(self.path, end)
        return n_kept

    def measure(self, n_rows: float = math.inf, steps: float = math.inf) -> tuple[int, int]:
        """Return the number of rows that `keep` would keep, and the bytes up to their end; change nothing."""
        names, n_kept, end = [], 0, 0
        for place, entries in self._rows(steps) if n_rows else ():
            n_kept += bool(names)
            names, end = names or entries, place
            if n_kept == n_rows:
                break
        if n_rows and not names and n_rows < math.inf and self.path.exists() and self.path.stat().st_size:
            self._refuse(1, "is no row of text")  # its rows may still be there
        self._names, self._n_rows = names, n_kept
        return n_kept, end

    def append(self, rows: Sequence[Mapping[str, object]]) -> None:
        """Append rows. Missing entries become NaN; a new entry adds a column, with NaN in all earlier rows."""
        if not rows:
            return
        n_rows, entries = self.n_rows, {_short_line(name): name for row in rows for name in row}
        added = [name for name in entries if name not in self._names]
        if self._names and added:
            rows_now = (entries for _, entries in self._rows())
            wider = ([*entries, *(["nan"] * len(added) if n else added)] for n, entries in enumerate(rows_now))
            write_atomically(self.path, map(_line, wider))
        self._names = names = [*self._names, *added]
        lines = b"".join(_line([plain_cell(row.get(entries.get(name, name), "nan")) for name in names]) for row in rows)
        if not self.path.exists() or self.path.stat().st_size == 0:
            n_rows, lines = 0, _line(names) + lines
        append_whole(self.path, lines)
        self._n_rows = n_rows + len(rows)

    def read(self) -> list[dict[str, str]]:
        """Return the rows as text by column, none if there is no file; an empty cell of a number becomes ``nan``."""
        rows = (entries for _, entries in self._rows())
        names = next(rows, [])
        empty = ["nan" if self._numbers is not None and name not in self._texts else "" for name in names]
        return [
            {name: text_of_cell(cell) or nothing for name, cell, nothing in zip(names, row, empty, strict=True)}
            for row in rows
        ]

    def numbers(self) -> list[dict[str, float]]:
        """Return the rows as numbers by column."""
        try:
            return [{name: float(text) for name, text in row.items()} for row in self.read()]
        except ValueError as error:
            raise InputError(f"{self.path} is broken: {error}") from error

    def _rows(self, most: float = math.inf) -> Iterator[tuple[int, list[str]]]:
        allowed = "a number of steps" + (f" up to {most:,}" if most < math.inf else "")
        end, names, torn, first_torn = 0, [], 0, 0
        if not self.path.exists():
            return
        with open_regular(self.path) as opened, open(opened, "rb", closefd=False) as file:
            for number, line in enumerate(iter(partial(file.readline, _LONGEST), b""), start=1):
                end += len(line)
                if not line.strip():  # a crash can leave such lines
                    continue
                if not line.endswith(b"\n") or b"\0" in line:  # a crash can leave this at the end
                    # Other encodings or line ends look the same, but have more lines after the one with the names.
                    is_foreign = not names and (torn > 0 or line.count(b"\r") > 1)
                    torn, first_torn = torn or number, first_torn if torn else end - len(line)
                    if is_foreign or end - first_torn > MOST_TEXT:
                        self._refuse(torn, "is no row of text")
                    continue
                entries = _entries(line, is_first=not names)
                if torn or entries is None:
                    self._refuse(torn or number, "is no row of text")
                if not names:
                    names = entries
                    if names[0] != _FIRST or len({*names}) < len(names):
                        self._refuse(number, "does not name the columns")
                    if missing := (self._numbers or {}).keys() - {*names}:
                        self._refuse(number, f"has no column {', '.join(sorted(missing))}")
                else:
                    self._check_row(number, names, entries)
                    if not 0 <= _steps(entries) <= most:
                        self._refuse(number, f"begins with {shown(entries[0])}, not with {allowed}")
                yield end, entries

    def _check_row(self, number: int, names: Sequence[str], entries: Sequence[str]) -> None:
        if len(entries) != len(names):
            self._refuse(number, "has not as many entries as the line that names them")
        if self._numbers is None:
            return
        for name, entry in zip(names, entries, strict=True):
            try:
                if name not in self._texts:
                    read_number(entry, name, self._numbers.get(name))
            except InputError as error:
                raise InputError(f"{self.path} is broken: line {number}: {error}") from None

    def _refuse(self, number: int, why: str) -> Never:
        raise InputError(f"{self.path} is broken: line {number} {why}")


def _line(entries: Sequence[object]) -> bytes:
    text = io.StringIO()
    csv.writer(text).writerow([_short_line(entry) if isinstance(entry, str) else entry for entry in entries])
    return text.getvalue().encode()


def _short_line(text: str) -> str:
    return " ".join(text.replace("\0", "\n").splitlines()).encode(errors="backslashreplace").decode()[:_LONGEST_CELL]


def _entries(line: bytes, *, is_first: bool) -> list[str] | None:
    try:
        text = line.decode()
        return next(csv.reader([text.lstrip("\ufeff") if is_first else text], strict=True), None) or None
    except (UnicodeDecodeError, csv.Error):
        return None


def _steps(entries: Sequence[str]) -> int:
    try:
        return int(float(entries[0]))
    except (ValueError, OverflowError):
        return -1
