"""A table in a CSV file that grows row by row while training goes on, and outlives a crash at any moment."""

from __future__ import annotations

import csv
import io
import itertools
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from hierroom.support.errors import InputError, shown
from hierroom.support.files import append_whole, sync, write_atomically

_FIRST = "steps"
_HEADER = -1
_PIECE = 2**20


class _Line(NamedTuple):
    """A line of the file that is not blank.

    Args:
        number: of the line, from 1.
        end: the place in the file after it, in bytes.
        content: the line itself.
        entries: what it holds; None: it is torn, or no line of a CSV file.
        steps: how many the row begins with, -1 for the names of the columns; None: it is no row of this table.
    """

    number: int
    end: int
    content: bytes
    entries: list[str] | None
    steps: int | None

    @property
    def is_torn(self) -> bool:
        """Whether it is as a crash leaves one: unfinished, or with zeros in the place of what was not yet written."""
        return not self.content.endswith(b"\n") or b"\0" in self.content


class CSVTable:
    """Rows of a CSV file, each of which begins with the number of ``steps`` trained before it was written.

    A row is one line, whatever it holds, so what a crash left of the last ones is found line by line. Columns may be
    added. Only `read` and `numbers` hold the whole table in memory.

    Args:
        path: the file; the first rows create it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._names: list[str] | None = None

    def append(self, rows: Sequence[Mapping[str, object]]) -> None:
        """Append rows, after dropping what a crash left of the last one; an empty sequence writes nothing.

        An entry that a row lacks is NaN. A new entry makes a new column, which is NaN in all earlier rows.
        """
        if not rows:
            return
        if self._names is None:  # the first time, as the file may be long
            self._names = self._heal()
        before, entries = self._names, dict.fromkeys(name for row in rows for name in row)
        added = [name for name in entries if name not in before]
        if before and added:
            self._widen(added)
        self._names = names = [*before, *added]
        lines = b"".join(_line([row.get(name, "nan") for name in names]) for row in rows)
        is_new = not self.path.exists() or self.path.stat().st_size == 0
        append_whole(self.path, _line(names) + lines if is_new else lines)

    def _widen(self, added: list[str]) -> None:
        """Add columns, in which the rows so far have NaN."""

        def lines() -> Iterator[bytes]:
            for line in self._lines():
                if line.entries is not None and line.steps is not None:
                    yield _line([*line.entries, *(added if line.steps == _HEADER else ["nan"] * len(added))])

        write_atomically(self.path, lines())

    def sync(self) -> None:
        """Have the rows outlive a loss of power."""
        sync(self.path)

    def _lines(self) -> Iterator[_Line]:
        """The lines of the file but for blank ones, of which a crash leaves some too."""
        end, n_columns = 0, None
        try:
            with suppress(FileNotFoundError), self.path.open("rb") as file:
                for number, content in enumerate(file, start=1):
                    end += len(content)
                    if not content.strip():
                        continue
                    entries, steps = _entries(content), None
                    if entries is not None and n_columns is None:
                        is_header = entries[0] == _FIRST and len({*entries}) == len(entries)
                        n_columns, steps = (len(entries), _HEADER) if is_header else (0, None)
                    elif entries is not None and len(entries) == n_columns:
                        steps = _steps(entries)
                    yield _Line(number, end, content, entries, steps)
        except OSError as error:
            raise InputError(f"cannot read {self.path}: {error.strerror}") from error

    def _heal(self) -> list[str]:
        """Drop what a crash left after the last row; returns the names of the columns, none where there is no row."""
        names, end = [], 0
        for line in self._lines():
            if line.entries is not None and line.steps is not None:
                names, end = names or line.entries, line.end
        self._cut(end)
        return names

    def _cut(self, end: int) -> None:
        """Delete what stands after a place in the file."""
        try:
            with suppress(FileNotFoundError):
                if self.path.stat().st_size > end:
                    os.truncate(self.path, end)
        except OSError as error:
            raise InputError(f"cannot write {self.path}: {error.strerror}") from error

    def read(self) -> list[dict[str, str]]:
        """The rows as text by column, none where there is no file. What a crash left after the last one is no row."""
        names, rows, torn = None, [], None
        for line in self._lines():
            if line.entries is None and line.is_torn:
                torn = torn or line
                continue
            if line.entries is None or torn is not None:
                raise InputError(f"{self.path} is broken: line {(torn or line).number} is no row of text")
            if names is None and line.steps != _HEADER:
                raise InputError(f"{self.path} is broken: line {line.number} does not name the columns")
            names = names or line.entries
            if len(line.entries) != len(names):
                raise InputError(
                    f"{self.path} is broken: line {line.number} has not as many entries as the line that names them"
                )
            if line.steps is None:
                first = shown(line.entries[0])
                raise InputError(
                    f"{self.path} is broken: line {line.number} begins with {first}, not with a number of steps"
                )
            if line.steps != _HEADER:
                rows.append(dict(zip(names, line.entries, strict=True)))
        return rows

    def numbers(self) -> list[dict[str, float]]:
        """The rows as numbers by column."""
        try:
            return [{name: float(text) for name, text in row.items()} for row in self.read()]
        except ValueError as error:
            raise InputError(f"{self.path} is broken: {error}") from error

    def drop_after(self, steps: int) -> str | None:
        """Delete the rows of more steps than these, which a resumed run writes again, and what a crash left of one.

        Among the rows of fewer steps a crash leaves no damage, but something else may: then what can be read of them is
        kept, and the table as it was stays beside it.

        Args:
            steps: of the last row to keep; -1: none is kept.

        Returns:
            a line that tells of the damage, or None.
        """
        self._names = None
        end, is_suspect, is_damaged = 0, False, False
        for line in self._lines():
            if line.steps is None:
                first, comma, _ = line.content.partition(b",")
                began_with = _steps([first.decode(errors="replace")]) if comma else None
                is_damaged |= began_with is not None and began_with <= steps  # it was a row to keep
                is_suspect = True
            elif line.steps <= steps:
                end, is_damaged = line.end, is_damaged or is_suspect
            else:
                is_suspect = True  # a row to drop, after which there are no others to keep
        if not is_damaged:
            self._cut(end)
            return None
        damaged = self._place_beside()
        write_atomically(damaged, self._pieces())
        kept = (line for line in self._lines() if line.steps is not None and line.steps <= steps)
        write_atomically(self.path, (line.content for line in kept))
        return f"{self.path} was damaged: what can be read of it is kept, and {damaged.name} is what it was"

    def _place_beside(self) -> Path:
        """A file that is not there yet, for what the table was."""
        endings = itertools.chain([""], (f"-{n}" for n in itertools.count(2)))
        places = (self.path.with_name(f"{self.path.name}.damaged{ending}") for ending in endings)
        return next(place for place in places if not place.exists())

    def _pieces(self) -> Iterator[bytes]:
        """The file as it is."""
        with self.path.open("rb") as file:
            while piece := file.read(_PIECE):
                yield piece


def _line(entries: Sequence[object]) -> bytes:
    """A row as one line, whatever a name in it holds."""
    text = io.StringIO()
    csv.writer(text).writerow([" ".join(entry.splitlines()) if isinstance(entry, str) else entry for entry in entries])
    return text.getvalue().encode(errors="backslashreplace")


def _entries(content: bytes) -> list[str] | None:
    """The entries of a line; None if it is unfinished or no line of a CSV file."""
    if not content.endswith(b"\n") or b"\0" in content:
        return None
    try:
        return next(csv.reader([content.decode()], strict=True))
    except (UnicodeDecodeError, csv.Error):
        return None


def _steps(entries: Sequence[str]) -> int | None:
    """The steps that a row begins with; None if it begins with something else."""
    try:
        steps = int(float(entries[0]))
    except (ValueError, OverflowError):
        return None
    return steps if steps >= 0 else None
