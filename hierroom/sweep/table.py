"""The table of a sweep: one row a run, in a CSV file that several processes may add to."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path

from filelock import FileLock

from hierroom.errors import InputError
from hierroom.files import write_atomically
from hierroom.sweep.plan import PlannedRun

Row = dict[str, str]


class SweepTable:
    """The rows of the runs that are done.

    Args:
        path: the CSV file; the first row creates it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def read(self) -> list[Row]:
        """All rows, none if there is no file.

        Raises:
            InputError: if it cannot be read, or is no table of a sweep.
        """
        try:
            with self.path.open(newline="") as file:
                rows = list(csv.DictReader(file, strict=True))
        except FileNotFoundError:
            return []
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise InputError(f"cannot read the table {self.path}: {error}") from error
        for number, row in enumerate(rows, start=2):
            if not row.get("digest") or None in row or None in row.values():
                raise InputError(f"{self.path} is no table of a sweep: row {number} is cut off, or has no digest")
        return rows

    def of(self, runs: tuple[PlannedRun, ...]) -> list[Row]:
        """The rows of some runs, in their order; a run that is not done has none."""
        by_digest = {row["digest"]: row for row in self.read()}
        return [by_digest[run.digest] for run in runs if run.digest in by_digest]

    def add(self, run: PlannedRun, numbers: Mapping[str, object]) -> None:
        """Add the row of a run, in the place of one that an older config of the same run had.

        Args:
            run: the run.
            numbers: the columns of its results.

        Raises:
            InputError: if the file cannot be read or written; then it is as before.
        """
        row = {**run.identity, **{name: _text(value) for name, value in numbers.items()}, "digest": run.digest}
        with FileLock(self.path.with_name(f".{self.path.name}.lock")):
            kept = [one for one in self.read() if one["digest"] != run.digest and not _is_same(one, run)]
            rows = [*kept, row]
            columns = list(dict.fromkeys([*run.identity, *(name for one in rows for name in one)]))
            text = io.StringIO()
            writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
            write_atomically(self.path, text.getvalue().encode())


def _is_same(row: Row, run: PlannedRun) -> bool:
    """Whether a row is of the same run with another config, such as an older preset."""
    return all(row.get(name, "") == text for name, text in run.identity.items())


def _text(value: object) -> str:
    """A number to six digits, of which seeds decide two; what has no value is empty."""
    if value is None or value != value or value in (float("inf"), -float("inf")):
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
