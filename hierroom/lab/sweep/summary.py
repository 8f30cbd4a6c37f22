"""A summary of a sweep's table: medians over the seeds of otherwise equal runs, for a terminal or in Markdown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING

from hierroom.lab.sweep.plan import PlannedRun
from hierroom.support.tables import markdown_table, named_table, telling_columns

if TYPE_CHECKING:
    import pandas as pd
    from rich.table import Table

_CAPTION = "medians of the seeds, in brackets from the lowest to the highest; -: half or more did not get so far"
_SINGLE_RUNS = "; of a single run, in square brackets the 95% interval that its evaluations leave"


@dataclass(frozen=True)
class Summary:
    """Medians over seeds, as text."""

    headings: tuple[str, ...]  # headings of the columns
    n_names: int  # number of columns that name the runs; the others are numbers
    lines: tuple[tuple[str, ...], ...]  # the cells of each line
    caption: str  # an explanation of the numbers

    def table(self) -> Table:
        """Return a table for a terminal."""
        return named_table(self.headings, self.lines, self.n_names, caption=self.caption)

    def markdown(self) -> str:
        """Return a table in Markdown."""
        return markdown_table(self.headings, self.lines)


def summarise(runs: Sequence[PlannedRun], rows: pd.DataFrame, metas: Sequence[str] = ()) -> Summary:
    """Return a line for each combination of values of the planned runs, with medians over its finished seeds."""
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
    if len(rows) and (has_none := rows["success_rate"] == "").any():  # of tasks without a target
        number = "{:.5g}".format
        returns = {"return": ("return", number), "mean return": ("area_under_curve", number)}
        returns["greedy return"] = ("greedy_return", number)
        if (goals := rows.get("score", rows["success_rate"]).ne("") & has_none).any():  # of those with goals
            shares = {"score": ("score", percent), "mean score": ("area_under_curve", percent)}
            shares |= {name: columns[name] for name in ("steps to 50%", "steps to 95%")}
            shares["greedy score"] = ("greedy_score", percent)
            returns = shares if (goals == has_none).all() else {**returns, **shares}
        columns = {**returns, "length": columns["length"]} if has_none.all() else {**columns, **returns}
    are_tasks = all(run.config.env.task is not None for run in runs)
    if are_tasks and not (len(rows) and rows["length_over_shortest"].any()):
        columns.pop("/ shortest", None)  # unknown for a user's environment
    planned = pd.DataFrame([run.identity for run in runs]).drop(columns="seed")
    names = telling_columns(planned) or ["method", "graph"]
    groups = dict([*rows.groupby(names, sort=False)]) if len(rows) else {}
    lines = []
    for values in planned[names].drop_duplicates().itertuples(index=False):
        if (group := groups.get(tuple(values))) is None:
            lines.append((*values, *"-" * (1 + len(columns))))
        else:
            lines.append((*values, str(len(group)), *(_spread(group, *column) for column in columns.values())))
    caption = _CAPTION + _SINGLE_RUNS * any(len(group) == 1 for group in groups.values())
    if are_tasks and "graph" in names:
        at = names.index("graph")
        names[at] = "task"
        short = {task: task.rpartition(".")[2] if ":" in task.rpartition(".")[2] else task for task in planned["graph"]}
        if len({*short.values()}) == len(short):  # without their packages
            lines = [(*line[:at], short[line[at]], *line[at + 1 :]) for line in lines]
    return Summary((*names, "runs", *columns), len(names), tuple(lines), caption)


def _spread(group: pd.DataFrame, name: str, text: Callable[[float], str]) -> str:
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
    """Return training steps as tables show them, such as 9,216, 53k and 1.50M."""
    if steps >= 1e6:
        return f"{steps / 1e6:.2f}M"
    return f"{steps / 1e3:.0f}k" if steps >= 10_000 else f"{steps:,.0f}"
