"""Lists of reports for papers and spreadsheets: CSV and Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal

from hierroom.complexity.report import ComplexityReport
from hierroom.complexity.walk_report import WalkReport, short
from hierroom.support.tables import csv_text, markdown_table

ColumnName = Literal["graph", "exit_depth", "width", "nodes", "edges", "hitting_time", "expected_steps", "std"]

COLUMNS: Mapping[ColumnName, tuple[str, int]] = {
    "graph": ("graph", 0),
    "exit_depth": ("exit\ndepth", 0),
    "width": ("width", 0),
    "nodes": ("nodes", 0),
    "edges": ("edges", 0),
    "hitting_time": ("hitting\ntime", 2),
    "expected_steps": ("expected\nsteps", 1),
    "std": ("std", 1),
}
"""The columns of the table of graphs, each with its heading and number of decimals."""
FIELDS: tuple[str, ...] = ("key_rooms", "exit_room", "drop_key", *COLUMNS)
"""The columns of `rows_of`."""


def value_of(report: WalkReport, column: ColumnName) -> Any:
    """Return a report's value in a column."""
    return report.name if column == "graph" else getattr(report, column)


def report_cells(report: WalkReport) -> list[str]:
    """Return a report's cells in a printed table, in the order of `COLUMNS`."""
    cells = []
    for name, (_, digits) in COLUMNS.items():
        value = value_of(report, name)
        cells.append(value if isinstance(value, str) else short(value, digits))
    return cells


def rows_of(reports: Iterable[WalkReport]) -> list[dict[str, Any]]:
    """Return one row of `FIELDS` for each report, in full precision; only goal graphs have rooms and drop_key."""
    rows = []
    for report in reports:
        of_graph: dict[str, Any] = dict.fromkeys(FIELDS[: -len(COLUMNS)])
        if isinstance(report, ComplexityReport):
            rooms = "-".join(map(str, report.graph.key_rooms))
            of_graph = {"key_rooms": rooms, "exit_room": report.graph.exit_room, "drop_key": report.drop_key}
        rows.append(of_graph | {name: value_of(report, name) for name in COLUMNS})
    return rows


def list_text(reports: Iterable[WalkReport], form: str) -> str:
    """Return the reports as ``csv`` in full precision, or as a rounded ``markdown`` table."""
    if form == "csv":
        return csv_text(rows_of(reports), FIELDS)
    headings = [heading.replace("\n", " ") for heading, _ in COLUMNS.values()]
    return markdown_table(headings, map(report_cells, reports)) + "\n"
