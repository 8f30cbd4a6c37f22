"""A sweep's table in short: medians over the seeds of runs that are alike otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from hierroom.sweep.plan import PlannedRun
from hierroom.sweep.table import Row

_NUMBERS = ("steps_to_50", "steps_to_95", "success_rate", "length")


def summary_table(runs: Sequence[PlannedRun], rows: Sequence[Row]) -> Table:
    """A line for each combination of values, its seeds together: medians, and the lowest success.

    Args:
        runs: all runs of the sweep.
        rows: of those that are done.
    """
    names = [name for name in runs[0].identity if name != "seed"]
    told = [name for name in names if len({run.identity[name] for run in runs}) > 1] or ["method", "graph"]
    table = Table(
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        caption="medians of the seeds; -: fewer than half got so far",
        caption_justify="left",
    )
    for name in told:
        table.add_column(name, overflow="fold")
    for heading in ("runs", "steps to\n50%", "steps to\n95%", "success", "worst", "length"):
        table.add_column(heading, justify="right", no_wrap=True)
    groups: dict[tuple[str, ...], list[Row]] = {tuple(run.identity[name] for name in told): [] for run in runs}
    for row in rows:
        groups[tuple(row[name] for name in told)].append(row)
    for cells, group in groups.items():
        if not group:
            table.add_row(*map(escape, cells), "0", *["-"] * 5)
            continue
        to_50, to_95, success, length = (median(float(row[name] or "inf") for row in group) for name in _NUMBERS)
        worst = min(float(row["success_rate"]) for row in group)
        numbers = (_steps(to_50), _steps(to_95), f"{success:.1%}", f"{worst:.1%}", f"{length:.0f}")
        table.add_row(*map(escape, cells), str(len(group)), *numbers)
    return table


def _steps(steps: float) -> str:
    if steps == float("inf"):
        return "-"
    return f"{steps / 1e6:.2f}M" if steps >= 1e6 else f"{steps / 1e3:.0f}k"
