"""A sweep's table in short: medians over the seeds of runs that are alike otherwise, for a terminal or in Markdown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from hierroom.lab.sweep.plan import PlannedRun
from hierroom.lab.sweep.table import Row
from hierroom.support.tables import markdown_table


@dataclass(frozen=True)
class Summary:
    """Medians over seeds, as text.

    Args:
        headings: of the columns.
        n_names: how many columns tell the runs apart; the others hold numbers.
        lines: the cells of each line.
        has_single_runs: whether some line is of one run.
    """

    headings: tuple[str, ...]
    n_names: int
    lines: tuple[tuple[str, ...], ...]
    has_single_runs: bool

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


CAPTION = "medians of the seeds, in brackets from the lowest to the highest; -: half or more did not get so far"
SINGLE_RUNS = "; of a single run, in square brackets the 95% interval that its evaluations leave"


def summarise(runs: Sequence[PlannedRun], rows: Sequence[Row], metas: Sequence[str] = ()) -> Summary:
    """A line for each combination of values, its seeds together.

    Args:
        runs: all runs of the sweep, at least one.
        rows: of those that are done.
        metas: the other meta-controllers with which the controllers were evaluated too.
    """
    columns: dict[str, Callable[[Sequence[Row]], str]] = {
        "runs": lambda group: str(len(group)),
        "steps to 50%": lambda group: _spread(group, "steps_to_50", steps_text),
        "steps to 95%": lambda group: _spread(group, "steps_to_95", steps_text),
        "success": lambda group: _spread(group, "success_rate", _percent),
        "length": lambda group: _spread(group, "length", "{:.0f}".format),
        "/ shortest": lambda group: _spread(group, "length_over_shortest", "{:.2f}".format),
        "greedy": lambda group: _spread(group, "greedy_success_rate", _percent),
    }
    for meta in metas:
        columns[f"{meta} goals"] = lambda group, name=f"{meta}_success_rate": _spread(group, name, _percent)
        columns[f"{meta} length"] = lambda group, name=f"{meta}_length": _spread(group, name, "{:.0f}".format)
    if any(run.config.env.exclude for run in runs):
        columns["excluded graphs"] = lambda group: _spread(group, "excluded_success_rate", _percent)
    names = _telling(runs)
    groups: dict[tuple[str, ...], list[Row]] = {tuple(run.identity[name] for name in names): [] for run in runs}
    for row in rows:
        groups[tuple(row[name] for name in names)].append(row)
    lines = [(*told, *(text(group) if group else "-" for text in columns.values())) for told, group in groups.items()]
    has_single_runs = any(len(group) == 1 for group in groups.values())
    return Summary((*names, *columns), len(names), tuple(lines), has_single_runs)


def _telling(runs: Sequence[PlannedRun]) -> list[str]:
    """The columns that tell the runs apart but for their seeds; a variant's name stands for what it changes."""
    several = [name for name in runs[0].identity if len({run.identity[name] for run in runs}) > 1 and name != "seed"]
    kept: list[str] = []
    for name in several:
        by_kept = {tuple(run.identity[one] for one in kept): run.identity[name] for run in runs}
        if any(by_kept[tuple(run.identity[one] for one in kept)] != run.identity[name] for run in runs):
            kept.append(name)
    return kept or ["method", "graph"]


def _numbers(group: Sequence[Row], name: str) -> list[float]:
    return [float(row.get(name) or "inf") for row in group]  # without evaluations there are no milestones


def _spread(group: Sequence[Row], name: str, text: Callable[[float], str]) -> str:
    """The median of runs that differ in their seeds, and how far they lie apart; of a single run its interval."""
    numbers, ends = _numbers(group, name), [f"{name.removesuffix('_rate')}_{end}" for end in ("low", "high")]
    middle = _text(median(numbers), text)
    if len(group) > 1:
        low, high = (_text(end(numbers), text) for end in (min, max))
        return middle if low == high else f"{middle} ({low} to {high})"
    low, high = (_text(_numbers(group, end)[0], text) if end in group[0] else middle for end in ends)
    return middle if low == high else f"{middle} [{low}, {high}]"


def _text(value: float, text: Callable[[float], str]) -> str:
    return "-" if value == float("inf") else text(value)


def _percent(value: float) -> str:
    return f"{value:.1%}"


def steps_text(steps: float) -> str:
    """Training steps as tables show them, such as 53k and 1.50M."""
    return f"{steps / 1e6:.2f}M" if steps >= 1e6 else f"{steps / 1e3:.0f}k"
