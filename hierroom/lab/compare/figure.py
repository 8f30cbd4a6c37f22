"""The figure of a comparison, for a paper: learning curves with bands, in a panel for all graphs and one for each."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, MaxNLocator

from hierroom.lab.compare.comparison import Comparison
from hierroom.lab.compare.curve import metric_of
from hierroom.lab.compare.style import DASHES, STYLE, line_style, save
from hierroom.lab.compare.tasks import ALL, OWN, Place
from hierroom.runs.results import step_unit
from hierroom.support.pictures import drawing, legend_text

MAX_PANELS = 12  # with more graphs, only the panel over all is drawn
_COLUMN, _PAGE = 3.3, 6.8  # inches: the width of a column and of a page of a paper in two columns
_LETTERS = 12  # letters of the legend per inch


def draw_comparison(comparison: Comparison, folder: Path) -> list[Path]:
    """Draw the learning curves of a comparison into ``curves.pdf`` and ``curves.png``; return these files."""
    with drawing(STYLE):
        return save(_figure(comparison), folder / "curves", 300)


def _figure(comparison: Comparison) -> Figure:
    panels, metric = _panels(comparison), metric_of(comparison.metric)
    n_columns = 3 if len(panels) in (5, 6, 9) else min(4, len(panels))
    n_rows = -(-len(panels) // n_columns)
    labels = [
        f"{legend_text(one.group.label)} ({one.n_seeds} seed{'s' * (one.n_seeds != 1)})"
        for one in comparison.of_graph(ALL)
    ]
    longest = (max(map(len, labels)) + 6) / _LETTERS
    width = max(_COLUMN if len(panels) == 1 else _PAGE, longest)
    n_legend = int(width / longest)  # columns
    legend_height = 0.18 * -(-len(labels) // n_legend)
    height = 2.3 if len(panels) == 1 else 1.55 * n_rows + 0.25
    figure = Figure(figsize=(width, height + legend_height), layout="constrained")
    axes = figure.subplots(n_rows, n_columns, squeeze=False, sharex=True, sharey=metric.is_rate)
    for place, (graph, title) in zip(axes.flat, panels.items(), strict=False):
        for summary in comparison.of_graph(graph):
            colour, dash = line_style(comparison.groups.index(summary.group))
            scale, label = metric.scale, legend_text(summary.group.label)
            steps, curve = summary.steps / step_unit(summary.steps[-1])[0], summary.curve
            place.plot(steps, scale * curve.values, color=colour, linestyle=DASHES[dash], linewidth=1.2, label=label)
            place.fill_between(steps, scale * curve.lows, scale * curve.highs, color=colour, alpha=0.2, linewidth=0)
        _finish(place, title, comparison)
    for place in axes.flat[len(panels) :]:
        place.remove()
    for column in range(n_columns):  # the lowest panel of each column has the numbers
        lowest = (len(panels) - 1 - column) // n_columns
        axes[lowest, column].tick_params(labelbottom=True)
        axes[lowest, column].set_xlabel(f"training steps ({step_unit(comparison.summaries[0].steps[-1])[1]})")
    for first in axes[:, 0]:
        first.set_ylabel(f"{metric.label} (%)" if metric.is_rate else metric.label)
    lines, _ = axes[0, 0].get_legend_handles_labels()
    columns = min(n_legend, len(labels))
    legend = figure.legend(lines, labels, loc="outside lower center", ncols=columns, handlelength=1.8)
    for text in legend.get_texts():
        text.set_parse_math(False)
    return figure


def _panels(comparison: Comparison) -> dict[Place, str]:
    graphs, kind = comparison.tasks.graphs, comparison.tasks.kind
    if graphs == (OWN,):
        return {ALL: ""}
    own: dict[Place, str] = {graph: f"{kind} {graph}" for graph in graphs}
    both: dict[Place, str] = {ALL: f"all {len(graphs)} {kind}s", **own}
    return own if len(graphs) == 1 else both if len(graphs) < MAX_PANELS else {ALL: both[ALL]}


def _finish(axes: Axes, title: str, comparison: Comparison) -> None:
    steps = comparison.summaries[0].steps / step_unit(comparison.summaries[0].steps[-1])[0]
    axes.set_title(title, fontsize=8, pad=3, parse_math=False)
    axes.set_xlim(steps[0], steps[-1])
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.grid(alpha=0.25, linewidth=0.5)
    if metric_of(comparison.metric).is_rate:
        axes.set_ylim(-2, 102)
        axes.set_yticks(np.arange(0, 101, 25))
