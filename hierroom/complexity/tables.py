"""Lists of reports for papers, spreadsheets and notebooks: CSV, LaTeX, Markdown and pandas."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from hierroom.complexity.measured import MeasuredReport
from hierroom.complexity.observed import Interval
from hierroom.complexity.played_chain import PlayedChain
from hierroom.complexity.report import ComplexityReport
from hierroom.support.errors import InputError, shown
from hierroom.support.markdown_table import markdown_table

if TYPE_CHECKING:
    import pandas  # type: ignore[import-not-found]

    from hierroom.complexity.measures.table import MeasuredGraph

ColumnName = Literal["graph", "exit_depth", "width", "nodes", "edges", "hitting_time", "expected_steps", "std"]


@dataclass(frozen=True)
class Column:
    """A column of the list of graphs: its heading, its value, and the format in which it is printed."""

    heading: str
    value: Callable[[ComplexityReport], Any]
    style: str = ""


COLUMNS: Mapping[ColumnName, Column] = {
    "graph": Column("graph", lambda report: report.graph.name),
    "exit_depth": Column("exit\ndepth", lambda report: report.exit_depth),
    "width": Column("width", lambda report: report.width),
    "nodes": Column("nodes", lambda report: report.nodes),
    "edges": Column("edges", lambda report: report.edges),
    "hitting_time": Column("hitting\ntime", lambda report: report.hitting_time, ".2f"),
    "expected_steps": Column("expected\nsteps", lambda report: report.expected_steps, ".1f"),
    "std": Column("std", lambda report: report.std, ".1f"),
}
TEX = str.maketrans({
    "\\": r"\textbackslash{}", "_": r"\_", "%": r"\%", "&": r"\&", "#": r"\#", "$": r"\$", "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "|": r"\textbar{}",
})  # fmt: skip


FIELDS: tuple[str, ...] = ("key_rooms", "exit_room", "drop_key", *COLUMNS)
"""The columns of `rows_of`."""
HEADS = tuple(column.heading.replace("\n", " ") for column in COLUMNS.values())


def rows_of(reports: Iterable[ComplexityReport]) -> list[dict[str, Any]]:
    """Each report as one row: what its goal graph is, and the columns of the list, in full precision."""
    return [
        {
            "key_rooms": "-".join(map(str, report.graph.key_rooms)),
            "exit_room": report.graph.exit_room,
            "drop_key": report.drop_key,
            **{name: column.value(report) for name, column in COLUMNS.items()},
        }
        for report in reports
    ]


def csv_text(reports: Iterable[ComplexityReport]) -> str:
    """The list as CSV, with a line of headings, in full precision."""
    text = io.StringIO()
    rows = rows_of(reports)
    writer = csv.DictWriter(text, FIELDS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def latex_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A LaTeX tabular with the rules of booktabs, without a line break at the end.

    Args:
        heads: the headings, the first that of names.
        rows: the texts of each line's cells.
    """
    lines = [r"\begin{tabular}{l" + "r" * (len(heads) - 1) + "}  % \\usepackage{booktabs}", r"\toprule"]
    lines += [" & ".join(head.translate(TEX) for head in heads) + r" \\", r"\midrule"]
    for cells in rows:
        texts = (r"$\infty$" if cell == "inf" else cell.translate(TEX).replace(" +- ", r" $\pm$ ") for cell in cells)
        lines.append(" & ".join(texts) + r" \\")
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}"])


def latex_text(reports: Iterable[ComplexityReport]) -> str:
    """The list as a LaTeX tabular, rounded as it is printed."""
    return latex_table(HEADS, map(report_cells, reports)) + "\n"


def markdown_text(reports: Iterable[ComplexityReport]) -> str:
    """The list as a Markdown table, rounded as it is printed."""
    return markdown_table(HEADS, map(report_cells, reports)) + "\n"


def to_frame(
    reports: ComplexityReport
    | MeasuredGraph
    | PlayedChain
    | MeasuredReport
    | Iterable[ComplexityReport]
    | Iterable[MeasuredGraph],
) -> pandas.DataFrame:
    """Reports as a pandas DataFrame, one row each, indexed by the names of their graphs.

    Args:
        reports: one report or several, from `analyze`; or rows of `measure_graphs` and `measure_levels`; or one chain
            from play or report of it, from `measure`, which has a row for each number, observed and of the chain, with
            its interval.
    """
    try:
        import pandas as pd  # type: ignore[import-not-found]
    except ImportError as error:
        raise InputError("to_frame needs pandas, which is not installed: pip install pandas") from error
    if isinstance(reports, (PlayedChain, MeasuredReport)):
        played = reports.played if isinstance(reports, MeasuredReport) else reports
        return pd.DataFrame.from_dict(_intervals(played), orient="index")
    from hierroom.complexity.measures.table import MeasuredGraph  # it brings rich along

    several = [*reports] if isinstance(reports, Iterable) else [reports]
    if several and all(isinstance(one, MeasuredGraph) for one in several):
        return pd.DataFrame([one.to_dict() for one in several]).set_index("graph")
    analyzed = [one for one in several if isinstance(one, ComplexityReport)]
    for other in (one for one in several if not isinstance(one, ComplexityReport)):
        raise InputError(f"to_frame takes reports of one kind, such as analyze gives them, not {shown(other)}")
    return pd.DataFrame(rows_of(analyzed), columns=list(FIELDS)).set_index("graph")


def _intervals(played: PlayedChain) -> dict[str, dict[str, float]]:
    """By the name of each number, what was observed, what the chain says, and the ends of their intervals."""
    none = Interval(math.nan, math.nan, math.nan)
    return {
        name: {
            f"{kind}{end}": value
            for kind, interval in (("observed", played.observed.get(name, none)), ("chain", measured))
            for end, value in zip(("", "_low", "_high"), interval, strict=True)
        }
        for name, measured in played.intervals.items()
    }


def report_cells(report: ComplexityReport) -> list[str]:
    """What a table says of a report, under `HEADS`."""
    return [_cell(column, report) for column in COLUMNS.values()]


def _cell(column: Column, report: ComplexityReport) -> str:
    value = column.value(report)
    if isinstance(value, float) and math.isfinite(value) and abs(value) >= 1e7:
        return format(value, ".4g")
    return format(value, column.style)
