"""Draw what of a method makes the difference: each method's ratio to one of them, with its interval.

    python -m benchmarks.study.forest TABLE.csv --reference "hippo as it is" --out docs/pictures/factors.png

The numbers are those of `benchmarks.study.factors`. A line for each method, on it a mark at the ratio and its interval;
right of the line at 1 the reference is faster. What is infinite, or 0, ends in an arrow at the edge, and has its mark
there. Methods that are compared by the same milestone stand together, and of these the variants of one method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator

from benchmarks.study import factors
from benchmarks.study.factors import Factor
from benchmarks.study.figure import MARKS
from benchmarks.study.picture import write
from benchmarks.study.tables import measures_for, read_rows
from hierroom.lab.compare.style import COLOURS
from hierroom.support.cli import run
from hierroom.support.errors import InputError

MARGIN = 1.6
"""The edge is this factor beyond the last finite number."""
BESIDE = 1.1
"""Factor between the arrow of a value beyond the edge and its mark."""
GAP = 0.7
"""Between the methods of two milestones, in lines."""


@dataclass(frozen=True, kw_only=True)
class Options(factors.Options):
    """Draw the methods of a table compared with one of them.

    Args:
        out: the picture; its suffix chooses the format.
    """

    out: Path


def draw(found: Sequence[Factor]) -> Figure:
    """Return the figure.

    Args:
        found: each method compared with the reference, the reference first.

    Raises:
        InputError: if there is no other method.
    """
    reference, *others = found
    if not others:
        raise InputError(f"there is no method besides {reference.method}")
    others = _in_groups(others)
    ratios = np.array([one.ratio for one in others], float)  # [methods, (value, low, high)]
    finite = ratios[np.isfinite(ratios) & (ratios > 0)]
    left, right = min([1.0, *finite]) / MARGIN, max([1.0, *finite]) * MARGIN
    outcomes = list(dict.fromkeys(one.outcome for one in others))
    figure = Figure(figsize=(8, 0.7 + 0.19 * len(others)), layout="constrained")
    axes = figure.subplots()
    axes.axvline(1.0, color="black", linewidth=0.6)
    lines = np.arange(len(others)) + GAP * np.array([outcomes.index(one.outcome) for one in others])
    for line, one, ratio in zip(lines, others, np.clip(ratios, left, right), strict=True):
        colour, mark = COLOURS[outcomes.index(one.outcome)], MARKS[outcomes.index(one.outcome)]
        value, low, high = ratio
        axes.plot([low, high], [line, line], color=colour, linewidth=1)
        for end, arrow in ((left, "<"), (right, ">")):
            if end in (low, high):
                axes.plot([end], [line], color=colour, marker=arrow, markersize=4)
        inside = np.clip(value, left * BESIDE, right / BESIDE)
        axes.plot([inside], [line], color=colour, marker=mark, markersize=4)
    axes.set_xscale("log")
    axes.set_xlim(left / 1.1, right * 1.1)
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel(f"training steps / those of {reference.method}")
    axes.set_yticks(lines, [one.method for one in others])
    axes.invert_yaxis()
    axes.grid(axis="x", alpha=0.25, linewidth=0.5)
    handles = [
        Line2D([], [], color=COLOURS[number], marker=MARKS[number], markersize=4, linewidth=1)
        for number in range(len(outcomes))
    ]
    figure.legend(
        handles, [f"{outcome.replace('_', ' ')}%" for outcome in outcomes], loc="outside upper right", ncols=4
    )
    return figure


def _in_groups(others: Sequence[Factor]) -> list[Factor]:
    """Group methods by milestone, then by the beginning of their names, each group at the place of its first."""
    outcomes = list(dict.fromkeys(one.outcome for one in others))
    methods = list(dict.fromkeys(one.method.split()[0] for one in others))
    return sorted(others, key=lambda one: (outcomes.index(one.outcome), methods.index(one.method.split()[0])))


def figure_of(options: Options) -> Figure:
    """Return the figure of a table's rows.

    Raises:
        InputError: as `draw` or `factors.factors` do, or if a table cannot be read.
    """
    return draw(factors.factors(read_rows(options.table), measures_for(options.table, options.measures), options))


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    write(lambda: figure_of(options), options.out)
    return 0


if __name__ == "__main__":
    run(main)
