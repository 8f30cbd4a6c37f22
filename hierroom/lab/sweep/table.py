"""The tables of a sweep, shared by processes: a row of texts for each finished run, and its learning curve."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hierroom.lab.sweep.plan import PlannedRun
from hierroom.runs.folder.run_lock import RunLock
from hierroom.support.cells import has_range, read_number, text_of_cell
from hierroom.support.errors import InputError
from hierroom.support.files import read_csv, refuse_foreign, write_atomically
from hierroom.support.tables import csv_text

if TYPE_CHECKING:
    import pandas as pd

_NEEDED = ("steps", "length")  # in every row
_LEFT_OUT_OF_CURVES = ("seconds", "graph", "success_low", "success_high")


class SweepTable:
    """The rows of a folder's finished runs, in ``sweep.csv``, and their learning curves, in ``curves.csv``."""

    def __init__(self, folder: Path) -> None:
        self.path, self.curves_path = folder / "sweep.csv", folder / "curves.csv"
        self._lock = RunLock(folder, ".sweep.csv.lock", timeout=-1)

    def read(self) -> pd.DataFrame:
        """Return all rows, none if there is no file."""
        return _read(self.path)

    def of(self, runs: Sequence[PlannedRun]) -> pd.DataFrame:
        """Return the rows of finished runs in the order of ``runs``; new columns of older rows get the run's values."""
        import pandas as pd

        rows = self.read().drop_duplicates("digest", keep="last").set_index("digest", drop=False)
        done = [run for run in runs if run.digest in rows.index]
        found = rows.loc[[run.digest for run in done]].reset_index(drop=True)
        return found.assign(**pd.DataFrame([run.identity for run in done], dtype=object))

    def curves(self) -> dict[str, pd.DataFrame]:
        """Return each run's learning curve by its digest: numbers ``steps``, ``episodes``, ``success_rate``, ..."""
        rows = _read(self.curves_path).set_index("digest")
        rows = rows[[*filter(has_range, rows)]].replace("", "nan").astype(float)  # without users' notes
        return {str(digest): curve for digest, curve in rows.groupby(level=0, sort=False)}

    def complete(self, runs: Sequence[PlannedRun]) -> None:
        """Fill the empty cells of columns that identify runs, such as those of entries that did not vary before.

        First check both tables, so that a broken one is reported before hours of training.
        """
        import pandas as pd

        refuse_foreign(replaced=[self.path, self.curves_path], changed=[self._lock.path])
        _read(self.curves_path)
        if self.read().empty:
            return
        identities = pd.DataFrame([run.identity for run in runs], index=[run.digest for run in runs], dtype=object)
        with self._lock:
            before = self.read()
            own = identities.reindex(before["digest"]).fillna("").set_axis(before.index)
            if (own == "").all(axis=None):  # the table has none of these runs
                return
            given = before.reindex(columns=own.columns, fill_value="")
            after = before.assign(**given.mask(given == "", own))
            if not after.equals(before):
                _write(self.path, after, [*own.columns])

    def add(
        self, run: PlannedRun, numbers: Mapping[str, object], evaluations: Sequence[Mapping[str, str]] = ()
    ) -> bool:
        """Add a row, and the curve if it has one goal graph; return whether it replaces a row of another config."""
        import pandas as pd

        row = {**run.identity, **{name: _text(value) for name, value in numbers.items()}, "digest": run.digest}
        with self._lock:
            before = self.read()
            before = before[before["digest"] != run.digest]
            kept = before[~_is_same(before, run)]
            # Add columns of entries with one value in this sweep, but several in an earlier one.
            row = {name: text for name, text in run.entries.items() if name in kept and len(kept)} | row
            curves = _read(self.curves_path)
            curves = curves[curves["digest"] != run.digest]
            if len({one["graph"] for one in evaluations}) == 1:
                points = pd.DataFrame([{"digest": run.digest, **_point(one)} for one in evaluations])
                curves = pd.concat([curves, points])
                # Write the curve first: after a crash between the two, the run has no row, so it is done again.
                _write(self.curves_path, curves)
            after = pd.concat([kept, pd.DataFrame([row])]) if len(kept) else pd.DataFrame([row])
            _write(self.path, after, [*run.identity])
            is_valid = curves["digest"].isin(after["digest"])
            if not is_valid.all():  # remove the curves of replaced rows
                _write(self.curves_path, curves[is_valid])
        return len(kept) < len(before)


def _read(path: Path) -> pd.DataFrame:
    import pandas as pd

    names, rows = read_csv(path) if path.exists() else ([], [])  # pandas would accept incomplete rows
    if not names:
        return pd.DataFrame(columns=["digest"], dtype=str)
    if "digest" not in names:
        raise InputError(f"{path} is no table of a sweep: it has no column digest")
    ranged = [name for name in names if has_range(name)]
    for number, row in rows:
        if not row["digest"]:
            raise InputError(f"{path} is no table of a sweep: line {number} has no digest")
        for name in ranged:
            try:
                if row[name] or name in _NEEDED:
                    read_number(row[name], name, -math.inf)
            except InputError as error:
                raise InputError(f"{path} is broken: line {number}: {error}") from None
    plain = [{name: text_of_cell(cell) for name, cell in row.items()} for _, row in rows]
    return pd.DataFrame(plain, columns=names, dtype=str)


def _write(path: Path, rows: pd.DataFrame, first: Sequence[str] = ()) -> None:
    columns = dict.fromkeys([*first, *rows.columns])
    write_atomically(path, csv_text(rows.reindex(columns=[*columns]).fillna("").to_dict("records"), [*columns]))


def _is_same(rows: pd.DataFrame, run: PlannedRun) -> pd.Series:
    is_same = rows["digest"] != ""
    for name, text in run.identity.items():
        is_same &= rows.get(name, "") == text
    for name in run.entries.keys() & set(rows):  # columns of entries that vary in some sweep
        is_same &= (rows[name] == run.entries[name]) | (rows[name] == "")
    return is_same


def _point(evaluation: Mapping[str, str]) -> dict[str, str]:
    kept = {name: text for name, text in evaluation.items() if name not in _LEFT_OUT_OF_CURVES}
    return {name: _text(float(text), ".5g") if name != "steps" else text for name, text in kept.items()}


def _text(value: object, style: str = ".6g") -> str:
    if value is None or value != value or value in (float("inf"), -float("inf")):
        return ""
    return format(value, style) if isinstance(value, float) else str(value)
