"""Lists of reports: the columns of their table, and rows for CSV."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from hierroom.complexity.report import ComplexityReport
from hierroom.complexity.walk_report import WalkReport, short

COLUMNS: Mapping[str, tuple[str, int]] = {
    "exit_depth": ("exit\ndepth", 0),
    "width": ("width", 0),
    "nodes": ("nodes", 0),
    "edges": ("edges", 0),
    "hitting_time": ("hitting\ntime", 2),
    "expected_steps": ("expected\nsteps", 1),
    "std": ("std", 1),
}
"""The columns of the table of graphs after their names, each with its heading and number of decimals."""
FIELDS: tuple[str, ...] = ("key_rooms", "exit_room", "drop_key", "graph", *COLUMNS)
"""The columns of `rows_of`."""


def report_cells(report: WalkReport) -> list[str]:
    """Return a report's cells in a printed table: its name, and those of `COLUMNS`."""
    return [report.name, *(short(getattr(report, name), digits) for name, (_, digits) in COLUMNS.items())]


def rows_of(reports: Iterable[WalkReport]) -> list[dict[str, Any]]:
    """Return one row of `FIELDS` for each report, in full precision; only goal graphs have rooms and drop_key."""
    rows = []
    for report in reports:
        of_graph: dict[str, Any] = {"graph": report.name}
        if isinstance(report, ComplexityReport):
            rooms = "-".join(map(str, report.graph.key_rooms))
            of_graph |= {"key_rooms": rooms, "exit_room": report.graph.exit_room, "drop_key": report.drop_key}
        rows.append(of_graph | {name: getattr(report, name) for name in COLUMNS})
    return rows
