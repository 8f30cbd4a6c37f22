"""A sweep's table in short: medians over the seeds of runs that are alike otherwise, for a terminal or in Markdown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING

from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from hierroom.lab.sweep.plan import PlannedRun
from hierroom.support.tables import markdown_table, telling_columns

if TYPE_CHECKING:
    import pandas as pd

CAPTION = "medians of the seeds, in brackets from the lowest to the highest; -: half or more did not get so far"
SINGLE_RUNS = "; of a single run, in square brackets the 95% interval that its evaluations leave"


@dataclass(frozen=True)
class Summary:
    """Medians over seeds, as text."""

    headings: tuple[str, ...]  # of the columns
    n_names: int  # how many columns tell the runs apart; the others hold numbers
    lines: tuple[tuple[str, ...], ...]  # the cells of each line
    has_single_runs: bool  # whether some line is of one run

    def caption(self) -> str:
        """How the numbers are read."""
        return f"{CAPTION}{SINGLE_RUNS if self.has_single_runs else ''}"

    def table(self) -> Table:
        """As a table for a terminal."""
        table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0), caption=self.caption(), caption_justify="left")
        for n, heading in enumerate(self.headings):
            table.add_column(heading, justify="right" if n >= self.n_names else "left", overflow="fold")
        for line in self.lines:
            table.add_row(*map(escape, line))
        return table

    def markdown(self) -> str:
        """As a table in Markdown."""
        return markdown_table(self.headings, self.lines)


def summarise(runs: Sequence[PlannedRun], rows: pd.DataFrame, metas: Sequence[str] = ()) -> Summary:
    """A line for each combination of values, its seeds together.

    Args:
        runs: all runs of the sweep, at least one.
        rows: of those that are done.
        metas: the other meta-controllers with which the controllers were evaluated too.
    """
    import pandas as pd

    percent, whole = "{:.1%}".format, "{:.0f}".format
    columns: dict[str, tuple[str, Callable[[float], str]]] = {
        "steps to 50%": ("steps_to_50", steps_text),
        "steps to 95%": ("steps_to_95", steps_text),
        "success": ("success_rate", percent),
        "length": ("length", whole),
        "/ shortest": ("length_over_shortest", "{:.2f}".format),
        "greedy": ("greedy_success_rate", percent),
    }
    for meta in metas:
        columns |= {f"{meta} goals": (f"{meta}_success_rate", percent), f"{meta} length": (f"{meta}_length", whole)}
    if any(run.config.env.exclude for run in runs):
        columns["excluded graphs"] = ("excluded_success_rate", percent)
    planned = pd.DataFrame([run.identity for run in runs]).drop(columns="seed")
    names = telling_columns(planned) or ["method", "graph"]
    groups = dict([*rows.groupby(names, sort=False)]) if len(rows) else {}
    lines = []
    for told in planned[names].drop_duplicates().itertuples(index=False):
        if (group := groups.get(tuple(told))) is None:
            lines.append((*told, *"-" * (1 + len(columns))))
        else:
            lines.append((*told, str(len(group)), *(_spread(group, *column) for column in columns.values())))
    has_single_runs = any(len(group) == 1 for group in groups.values())
    return Summary((*names, "runs", *columns), len(names), tuple(lines), has_single_runs)


def _spread(group: pd.DataFrame, name: str, text: Callable[[float], str]) -> str:
    """The median of runs that differ in their seeds, and how far they lie apart; of a single run its interval."""
    stem = name.removesuffix("_rate")
    numbers = group.reindex(columns=[name, f"{stem}_low", f"{stem}_high"], fill_value="").replace("", "inf")
    values, lows, highs = numbers.astype(float).T.to_numpy()  # without evaluations there are no milestones
    middle = _text(median(values), text)
    if len(group) > 1:
        low, high = _text(min(values), text), _text(max(values), text)
        return middle if low == high else f"{middle} ({low} to {high})"
    ends = ((f"{stem}_low", lows[0]), (f"{stem}_high", highs[0]))
    low, high = (_text(value, text) if column in group else middle for column, value in ends)
    return middle if low == high else f"{middle} [{low}, {high}]"


def _text(value: float, text: Callable[[float], str]) -> str:
    return "-" if value == float("inf") else text(value)


def steps_text(steps: float) -> str:
    """Training steps as tables show them, such as 53k and 1.50M."""
    return f"{steps / 1e6:.2f}M" if steps >= 1e6 else f"{steps / 1e3:.0f}k"
