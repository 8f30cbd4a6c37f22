"""The tables of a sweep: a row for each run that is done, and its learning curve, in files that processes share.

Every cell is a text. pandas is loaded where a table is read, as what says how a sweep is called need not wait for it.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from filelock import FileLock

from hierroom.lab.sweep.plan import PlannedRun
from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically

if TYPE_CHECKING:
    import pandas as pd

_LEFT_OUT_OF_CURVES = ("seconds", "graph", "success_low", "success_high", "return")


class SweepTable:
    """The rows of the runs that are done, in ``sweep.csv``, and their learning curves, in ``curves.csv``.

    Args:
        folder: of the sweep; the first row creates the files.
    """

    def __init__(self, folder: Path) -> None:
        self.path, self.curves_path = folder / "sweep.csv", folder / "curves.csv"
        self._lock = FileLock(self.path.with_name(f".{self.path.name}.lock"))

    def read(self) -> pd.DataFrame:
        """All rows, none if there is no file."""
        return _read(self.path)

    def of(self, runs: Sequence[PlannedRun]) -> pd.DataFrame:
        """The rows of some runs, in their order; a run that is not done has none.

        A row that was written when a sweep had one value of an entry lacks the column that tells it from others.
        """
        import pandas as pd

        rows = self.read().drop_duplicates("digest", keep="last").set_index("digest", drop=False)
        done = [run for run in runs if run.digest in rows.index]
        found = rows.loc[[run.digest for run in done]].reset_index(drop=True)
        return found.assign(**pd.DataFrame([run.identity for run in done], dtype=object))

    def curves(self) -> dict[str, pd.DataFrame]:
        """The learning curve of each run by its digest: numbers ``steps``, ``episodes``, ``success_rate``, ..."""
        rows = _read(self.curves_path).set_index("digest").replace("", "nan").astype(float)
        return {str(digest): curve for digest, curve in rows.groupby(level=0, sort=False)}

    def complete(self, runs: Sequence[PlannedRun]) -> None:
        """Fill what is empty of the columns that tell some runs apart, as those of entries that did not vary before."""
        import pandas as pd

        if not self.path.exists():
            return
        identities = pd.DataFrame([run.identity for run in runs], index=[run.digest for run in runs], dtype=object)
        with self._lock:
            before = self.read()
            told = identities.reindex(before["digest"]).fillna("").set_axis(before.index)
            if (told == "").all(axis=None):  # the table has none of these runs
                return
            given = before.reindex(columns=told.columns, fill_value="")
            after = before.assign(**given.mask(given == "", told))
            if not after.equals(before):
                _write(self.path, after, [*told.columns])

    def add(
        self, run: PlannedRun, numbers: Mapping[str, object], evaluations: Sequence[Mapping[str, str]] = ()
    ) -> bool:
        """Add the row of a run, in the place of one that another config of the same run had, such as an older one.

        Args:
            run: the run.
            numbers: the columns of its results.
            evaluations: the rows of its ``evaluations.csv``, which are left out where there are several goal graphs.

        Returns:
            Whether it stands in the place of another.
        """
        import pandas as pd

        row = {**run.identity, **{name: _text(value) for name, value in numbers.items()}, "digest": run.digest}
        with self._lock:
            before = self.read()
            before = before[before["digest"] != run.digest]
            kept = before[~_is_same(before, run)]
            # A column of an entry that this sweep has one value of, and an earlier one had several.
            row = {name: text for name, text in run.entries.items() if name in kept and len(kept)} | row
            curves = _read(self.curves_path)
            curves = curves[curves["digest"] != run.digest]
            if len({one["graph"] for one in evaluations}) == 1:
                points = pd.DataFrame([{"digest": run.digest, **_point(one)} for one in evaluations])
                curves = pd.concat([curves, points])
                # First: after a crash between the two the run has a curve and no row, so that it is done again.
                _write(self.curves_path, curves)
            after = pd.concat([kept, pd.DataFrame([row])]) if len(kept) else pd.DataFrame([row])
            _write(self.path, after, [*run.identity])
            is_valid = curves["digest"].isin(after["digest"])
            if not is_valid.all():  # those of rows that were replaced
                _write(self.curves_path, curves[is_valid])
        return len(kept) < len(before)


def _read(path: Path) -> pd.DataFrame:
    import pandas as pd

    try:
        with path.open(newline="", encoding="utf-8") as file:  # pandas takes rows that are cut off
            reader = csv.DictReader(file, strict=True)
            rows, names = list(reader), reader.fieldnames or ()
    except FileNotFoundError:
        return pd.DataFrame(columns=["digest"], dtype=str)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"cannot read the table {path}: {error}") from error
    for number, row in enumerate(rows, start=2):
        if not row.get("digest") or None in row or None in row.values():
            raise InputError(f"{path} is no table of a sweep: row {number} is cut off, or has no digest")
    return pd.DataFrame(rows, columns=[*dict.fromkeys([*names, "digest"])], dtype=str)


def _write(path: Path, rows: pd.DataFrame, first: Sequence[str] = ()) -> None:
    columns = dict.fromkeys([*first, *rows.columns])
    text = rows.reindex(columns=[*columns]).fillna("").to_csv(index=False, lineterminator="\n")
    write_atomically(path, text.encode())


def _is_same(rows: pd.DataFrame, run: PlannedRun) -> pd.Series:
    """Whether each row is of the same run with another config, such as an older preset.

    Where the rows have a column of an entry, as of a sweep of several values of it, that value must be the run's.
    """
    is_same = rows["digest"] != ""
    for name, text in run.identity.items():
        is_same &= rows.get(name, "") == text
    for name in run.entries.keys() & set(rows):
        is_same &= (rows[name] == run.entries[name]) | (rows[name] == "")
    return is_same


def _point(evaluation: Mapping[str, str]) -> dict[str, str]:
    """A point of a learning curve: what the table of a thousand runs has room for."""
    kept = {name: text for name, text in evaluation.items() if name not in _LEFT_OUT_OF_CURVES}
    return {name: _text(float(text), ".5g") if name != "steps" else text for name, text in kept.items()}


def _text(value: object, style: str = ".6g") -> str:
    """A number in few digits, of which seeds decide two; what has no value is empty."""
    if value is None or value != value or value in (float("inf"), -float("inf")):
        return ""
    return format(value, style) if isinstance(value, float) else str(value)
