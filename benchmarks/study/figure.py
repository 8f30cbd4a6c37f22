"""Draw what was trained against measures that were computed before.

    python -m benchmarks.study.figure TABLE.csv --out docs/pictures/study.png

A panel for each measure, a mark for each goal graph and method: the median over seeds, and a line from the lowest to
the highest. A graph on which half of the seeds or more never reached the milestone has an empty triangle at the top.
Graphs that share a value of a count stand side by side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from benchmarks.study.picture import write
from benchmarks.study.tables import Row, first_seeds, measures_for, read_rows
from benchmarks.study.trained import MEASURES, Milestone, Trained, measures_of, medians, read_trained
from hierroom.goals import NAMED_GRAPHS
from hierroom.lab.compare.style import COLOURS
from hierroom.support.cli import run
from hierroom.support.errors import InputError

MARKS = "osD^v"
FEW = 12
"""Of so many goal graphs the paper's are labelled by their letters."""
WIDE = 20
"""Least ratio of a measure's largest to its smallest value for a logarithmic axis."""
FEW_EACH = 4
"""A measure that has on average so many graphs at each of its values, or more, is a count."""
SPREAD = 0.7
"""Of the least distance of two counts is filled by the graphs that share one."""
WIDTH = 2.6
"""Of a panel in inches."""
LETTERS_PER_INCH = 16
"""Of the legend."""


@dataclass(frozen=True)
class Options:
    """Draw difficulty against measures.

    Args:
        table: the training runs.
        out: the picture; its suffix chooses the format.
        shown: the measures, a panel each.
        measures: the measures of the goal graphs; by default measures.csv next to the table, else its study's.
        outcome: what says how hard a graph was.
        seeds: only seeds 0, 1, ..., so many of them, as of a sweep that goes on; all by default.
    """

    table: tyro.conf.Positional[Path]
    out: Path
    shown: tuple[str, ...] = ("goals", "exit_depth", "hitting_time", "play_expected_steps")
    measures: Path | None = None
    outcome: Milestone = "steps_to_95"
    seeds: int | None = None


def draw(trained: Sequence[Trained], measured: Sequence[Row], options: Options) -> Figure:
    """Return the figure.

    Args:
        trained: the outcomes of each method.
        measured: rows of the table of measures.
        options: which measures are shown.

    Raises:
        InputError: if there is no measure, or one is unknown, missing for a graph, or the same for all.
    """
    if not options.shown:
        raise InputError("show at least one measure, such as --shown expected_steps")
    figure = Figure(figsize=(WIDTH * len(options.shown) + 0.5, 2.8), layout="constrained")
    panels = figure.subplots(1, len(options.shown), sharey=True, squeeze=False)[0]
    known = {method.method: measures_of(method.graphs, measured) for method in trained}
    for name, axes in zip(options.shown, panels, strict=True):
        for number, method in enumerate(trained):
            if name not in known[method.method]:
                names = ", ".join(known[method.method]) or "none"
                raise InputError(f"cannot show {name}; known of all graphs, and different between them, are {names}")
            values = _spread(MEASURES[name] * known[method.method][name])
            _draw_method(axes, values, method, number, _top(trained))
            if 0 < values.min() * WIDE < values.max():
                axes.set_xscale("log")
        axes.set_xlabel(_label(name))
        axes.set_yscale("log")
        axes.grid(alpha=0.25, linewidth=0.5)
    panels[0].set_ylabel(f"training {options.outcome.replace('_', ' ')}%")
    handles = dict(zip(*reversed(panels[0].get_legend_handles_labels()), strict=True))
    columns = max(1, int(WIDTH * len(options.shown) * LETTERS_PER_INCH) // max(len(name) + 6 for name in handles))
    figure.legend([*handles.values()], [*handles], loc="outside upper left", ncols=columns)
    return figure


def figure_of(options: Options) -> Figure:
    """Return the figure of a table's rows.

    Raises:
        InputError: as `draw` does, or if a table cannot be read.
    """
    measured = measures_for(options.table, options.measures)
    rows = first_seeds(read_rows(options.table), options.seeds)
    return draw(read_trained(rows, measured, options.outcome), measured, options)


def _spread(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the values [G], those of a count side by side, as many graphs share each."""
    distinct, where, shared = np.unique(values, return_inverse=True, return_counts=True)
    if len(distinct) * FEW_EACH > len(values) or len(distinct) < 2:
        return values
    place = np.array([(where[:graph] == own).sum() for graph, own in enumerate(where)])
    return values + SPREAD * np.diff(distinct).min() * ((place + 0.5) / shared[where] - 0.5)


def _label(measure: str) -> str:
    """Return the name of a panel's measure."""
    words = measure.removeprefix("play_").replace("_", " ")
    return words if words == measure.replace("_", " ") else f"{words} of random play"


def _top(trained: Sequence[Trained]) -> float:
    """Return the height of graphs that never got there: above all others."""
    reached = [method.outcomes[np.isfinite(method.outcomes)] for method in trained]
    return 1.5 * max((one.max() for one in reached if one.size), default=1.0)


def _draw_method(axes: Axes, values: NDArray[np.float64], method: Trained, number: int, top: float) -> None:
    middle, colour = medians(method.outcomes), COLOURS[number % len(COLOURS)]
    low, high = np.nanmin(method.outcomes, axis=1), np.minimum(np.nanmax(method.outcomes, axis=1), top)
    reached = np.isfinite(middle)
    axes.vlines(values[reached], low[reached], high[reached], color=colour, linewidth=0.7, alpha=0.5)
    mark = MARKS[number % len(MARKS)]
    axes.scatter(values[reached], middle[reached], s=14, color=colour, marker=mark, label=method.method, linewidth=0)
    axes.scatter(values[~reached], np.full((~reached).sum(), top), s=18, marker="^", facecolor="none", edgecolor=colour)
    if len(values) <= FEW:
        for x, y, graph in zip(values, np.minimum(middle, top), method.graphs, strict=True):
            if graph in NAMED_GRAPHS:
                axes.annotate(graph, (x, y), textcoords="offset points", xytext=(4, -2), fontsize=7)


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    write(lambda: figure_of(options), options.out)
    return 0


if __name__ == "__main__":
    run(main)
