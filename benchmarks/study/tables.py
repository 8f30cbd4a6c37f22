"""The study's tables as they stand in files: the measures of goal graphs, and what was trained on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.committed import ROOT
from hierroom.support.cells import text_of_cell
from hierroom.support.errors import InputError
from hierroom.support.files import read_csv

MEASURES_PATH = Path("benchmarks/results/study/measures.csv")
NEEDED = {"graph", "twin_of", "rooms", "goals", "settings"}
Row = Mapping[str, str]


def read_measures(path: Path) -> list[Row]:
    """Return the rows of a table of measures, one a goal graph; none where there is no file.

    Raises:
        InputError: if it cannot be read, or is no such table.
    """
    rows = read_rows(path) if path.exists() else []
    if rows and (missing := NEEDED.difference(rows[0])):
        raise InputError(f"{path} is no table of measures: it has no column {', '.join(sorted(missing))}")
    return rows


def measures_for(table: Path, given: Path | None = None) -> list[Row]:
    """Return the rows of the measures of a table of training runs.

    Args:
        table: the training runs.
        given: the table of measures. None: measures.csv next to the training runs, else in the folder of their study:
            conjecture for conjecture_factors. If there is none, results/study/measures.csv.

    Raises:
        InputError: if there is none, or it holds none, or as `read_measures`.
    """
    folder = table.resolve().parent
    own = [one / "measures.csv" for one in (folder, folder.with_name(folder.name.partition("_")[0]))]
    path = given or next((path for path in own if path.exists()), ROOT / MEASURES_PATH)
    if not path.exists():
        raise InputError(f"there is no table of measures {path}; run this where it is, or give --measures")
    if not (rows := read_measures(path)):
        raise InputError(f"{path} holds no measures; make it: python -m benchmarks.study.measures_table")
    return rows


def first_seeds(rows: Sequence[Row], n_seeds: int | None) -> list[Row]:
    """Return the rows of seeds 0, 1, ...; an unfinished sweep has the first of them.

    Args:
        rows: of a table of training runs.
        n_seeds: how many seeds; None: all there are.

    Raises:
        InputError: if there is no such seed.
    """
    if n_seeds is None:
        return [*rows]
    chosen = [row for row in rows if row.get("seed", "").isdecimal() and int(row["seed"]) < n_seeds]
    if not chosen:
        raise InputError(f"the table has no row of a seed below {n_seeds}")
    return chosen


def read_rows(path: Path) -> list[Row]:
    """Return the rows of a CSV file, such as a table of runs.

    Raises:
        InputError: if it cannot be read, or a row has another number of columns than its headings.
    """
    return [{name: text_of_cell(cell) for name, cell in row.items()} for _, row in read_csv(path)[1]]
