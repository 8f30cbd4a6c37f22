"""The tables of a sweep: a row for each run that is done, and its learning curve, in files that processes share."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

from filelock import FileLock

from hierroom.lab.sweep.plan import PlannedRun
from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically

Row = dict[str, str]
_LEFT_OUT_OF_CURVES = ("seconds", "graph", "success_low", "success_high", "return")


class SweepTable:
    """The rows of the runs that are done, in ``sweep.csv``, and their learning curves, in ``curves.csv``.

    Args:
        folder: of the sweep; the first row creates the files.
    """

    def __init__(self, folder: Path) -> None:
        self.path, self.curves_path = folder / "sweep.csv", folder / "curves.csv"

    def read(self) -> list[Row]:
        """All rows, none if there is no file."""
        return _read(self.path)

    def of(self, runs: Sequence[PlannedRun]) -> list[Row]:
        """The rows of some runs, in their order; a run that is not done has none.

        A row that was written when a sweep had one value of an entry lacks the column that tells it from others.
        """
        by_digest = {row["digest"]: row for row in self.read()}
        return [{**by_digest[run.digest], **run.identity} for run in runs if run.digest in by_digest]

    def curves(self) -> dict[str, list[Row]]:
        """The learning curve of each run by its digest: rows of ``steps``, ``episodes``, ``success_rate``, ..."""
        curves: dict[str, list[Row]] = {}
        for row in _read(self.curves_path):
            curves.setdefault(row["digest"], []).append(row)
        return curves

    def complete(self, runs: Sequence[PlannedRun]) -> None:
        """Fill what is empty of the columns that tell some runs apart, as those of entries that did not vary before."""
        if not self.path.exists():
            return
        identities = {run.digest: run.identity for run in runs}
        with FileLock(self.path.with_name(f".{self.path.name}.lock")):
            before = self.read()
            rows = [_completed(row, identities.get(row["digest"], {})) for row in before]
            if rows != before:
                _write(self.path, rows, [*runs[0].identity])

    def add(self, run: PlannedRun, numbers: Mapping[str, object], evaluations: Sequence[Row] = ()) -> bool:
        """Add the row of a run, in the place of one that another config of the same run had, such as an older one.

        Args:
            run: the run.
            numbers: the columns of its results.
            evaluations: the rows of its ``evaluations.csv``, which are left out where there are several goal graphs.

        Returns:
            Whether it stands in the place of another.
        """
        row = {**run.identity, **{name: _text(value) for name, value in numbers.items()}, "digest": run.digest}
        with FileLock(self.path.with_name(f".{self.path.name}.lock")):
            before = [one for one in self.read() if one["digest"] != run.digest]
            kept = [one for one in before if not _is_same(one, run)]
            # A column of an entry that this sweep has one value of, and an earlier one had several.
            row = {**{name: text for name, text in run.entries.items() if any(name in one for one in kept)}, **row}
            curves = [one for one in _read(self.curves_path) if one["digest"] != run.digest]
            if len({one["graph"] for one in evaluations}) == 1:
                curves += [{"digest": run.digest, **_point(one)} for one in evaluations]
                # First: after a crash between the two the run has a curve and no row, so that it is done again.
                _write(self.curves_path, curves)
            _write(self.path, [*kept, row], [*run.identity])
            valid = {run.digest, *(one["digest"] for one in kept)}
            if not {one["digest"] for one in curves} <= valid:  # those of rows that were replaced
                _write(self.curves_path, [one for one in curves if one["digest"] in valid])
        return len(kept) < len(before)


def _completed(row: Row, identity: Mapping[str, str]) -> Row:
    return {**row, **{name: text for name, text in identity.items() if not row.get(name)}}


def _read(path: Path) -> list[Row]:
    try:
        with path.open(newline="") as file:
            rows = list(csv.DictReader(file, strict=True))
    except FileNotFoundError:
        return []
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"cannot read the table {path}: {error}") from error
    for number, row in enumerate(rows, start=2):
        if not row.get("digest") or None in row or None in row.values():
            raise InputError(f"{path} is no table of a sweep: row {number} is cut off, or has no digest")
    return rows


def _write(path: Path, rows: Sequence[Row], first: Sequence[str] = ()) -> None:
    columns = list(dict.fromkeys([*first, *(name for row in rows for name in row)]))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_atomically(path, text.getvalue().encode())


def _is_same(row: Row, run: PlannedRun) -> bool:
    """Whether a row is of the same run with another config, such as an older preset.

    Where the row has a column of an entry, as of a sweep of several values of it, that value must be the run's.
    """
    told = {name: text for name, text in row.items() if text and name in run.entries}
    return all(row.get(name, "") == text for name, text in run.identity.items()) and all(
        run.entries[name] == text for name, text in told.items()
    )


def _point(evaluation: Row) -> Row:
    """A point of a learning curve: what the table of a thousand runs has room for."""
    kept = {name: text for name, text in evaluation.items() if name not in _LEFT_OUT_OF_CURVES}
    return {name: _text(float(text), ".5g") if name != "steps" else text for name, text in kept.items()}


def _text(value: object, style: str = ".6g") -> str:
    """A number in few digits, of which seeds decide two; what has no value is empty."""
    if value is None or value != value or value in (float("inf"), -float("inf")):
        return ""
    return format(value, style) if isinstance(value, float) else str(value)
