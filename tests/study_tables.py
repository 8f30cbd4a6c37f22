"""Made-up tables for the tests of the study."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any


def write_tables(folder: Path, **tables: Sequence[Mapping[str, Any]]) -> None:
    """Write ``NAME.csv`` for each name of a table, its rows by column."""
    for name, rows in tables.items():
        with (folder / f"{name}.csv").open("w") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)
