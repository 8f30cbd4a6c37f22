"""Figures 3 to 5: learning curves, steps to each goal, and the hitting time against success and length."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import tyro
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.console import Console

from benchmarks.paper.cells import LIMIT, Curves, curves_of, table_3, values_at
from benchmarks.paper.order import prediction
from benchmarks.paper.published import METHODS, PAPER_TABLE_2
from benchmarks.paper.runs import PaperRuns, cell, mean_and_interval
from benchmarks.paper.table2 import Table2
from benchmarks.paper.table3 import Table3
from hierroom.lab.compare.style import COLOURS, DASHES, STYLE, save
from hierroom.lab.sweep.sweep import Sweep
from hierroom.support.errors import InputError
from hierroom.support.pictures import drawing

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class _PaperFigure(ABC):
    runs: tyro.conf.OmitArgPrefixes[PaperRuns]
    graphs: ClassVar[str] = "abcdefg"
    methods: ClassVar[tuple[str, ...]] = tuple(METHODS)

    def run(self) -> None:
        sweep = self.runs.train(self.graphs, self.methods)
        for size in self.runs.sizes:
            figure, path = self.draw(sweep, size), self.runs.out / f"{type(self).__name__.lower()}-{size}"
            with drawing(STYLE):
                save(figure, path, 200)
            print(f"drawn: {path}.pdf, {path}.png")
            if sentence := self.sentence(sweep, size):
                Console().print(sentence, highlight=False)

    @abstractmethod
    def draw(self, sweep: Sweep, size: int) -> Figure: ...

    def sentence(self, sweep: Sweep, size: int) -> str:
        return ""


@dataclass(frozen=True)
class Figure3(_PaperFigure):
    """Draw learning curves of four methods (Figure 3), with 95% bands over seeds; train missing runs first."""

    def draw(self, sweep: Sweep, size: int) -> Figure:
        """Draw the figure from the sweep's rows."""
        rows, curves = sweep.rows(), sweep.table.curves()
        graphs = [graph for graph in self.graphs if graph in self.runs.graphs]
        figure = Figure(figsize=(1.6 * max(2, len(graphs)) + 0.6, 3.6), layout="constrained")
        axes = figure.subplots(2, len(graphs), squeeze=False, sharex=True, sharey="row")
        for column, graph in enumerate(graphs):
            for row, (name, scale) in enumerate((("success_rate", 100.0), ("length", 100 / LIMIT))):
                for method in METHODS:
                    _draw_curve(axes[row, column], cell(rows, method, graph, size), curves, name, scale, method)
                axes[row, column].set_ylim(-2, 102)
            axes[0, column].set_title(f"({graph})", fontsize=8)
        axes[0, 0].set_ylabel("success (%)")
        axes[1, 0].set_ylabel("length (% of 1000)")
        return _labelled(figure, axes)


@dataclass(frozen=True)
class Figure4(_PaperFigure):
    """Draw steps to each intermediate goal on graph c while four methods learn (Figure 4); train missing runs first."""

    graphs: ClassVar[str] = "c"

    def run(self) -> None:
        """Train missing runs, and draw the figure."""
        if "c" not in self.runs.graphs:
            raise InputError(f"figure 4 is of graph c alone, not of {', '.join(self.runs.graphs)}")
        _PaperFigure.run(replace(self, runs=replace(self.runs, graphs=("c",))))

    def draw(self, sweep: Sweep, size: int) -> Figure:
        """Draw the figure from the sweep's rows."""
        rows, curves = sweep.rows(), sweep.table.curves()
        goals = ("key_1", "door_1", "key_2", "door_2", "exit")
        figure = Figure(figsize=(1.6 * len(goals) + 0.6, 2.2), layout="constrained")
        axes = figure.subplots(1, len(goals), squeeze=False, sharex=True, sharey=True)
        for column, goal in enumerate(goals):
            for method in METHODS:
                own = cell(rows, method, "c", size)
                _draw_curve(axes[0, column], own, _limited(curves, goal), f"steps_to_{goal}", 1.0, method)
            axes[0, column].set_title(goal.replace("_", " "), fontsize=8)
            axes[0, column].set_ylim(0, LIMIT * 1.02)
        axes[0, 0].set_ylabel("steps to the goal")
        return _labelled(figure, axes)


@dataclass(frozen=True)
class Figure5(_PaperFigure):
    """Draw success and length of HiPPO over the hitting time (Figure 5), ours and the paper's; train missing runs."""

    methods: ClassVar[tuple[str, ...]] = ("hippo",)

    def sentence(self, sweep: Sweep, size: int) -> str:
        """Return the rank correlations."""
        return prediction(table_3(sweep.rows(), sweep.table.curves(), (size,)))

    def draw(self, sweep: Sweep, size: int) -> Figure:
        """Draw the figure from the sweep's rows."""
        figure = Figure(figsize=(5.4, 2.4), layout="constrained")
        axes = figure.subplots(1, 2, squeeze=False)
        cells = table_3(sweep.rows(), sweep.table.curves(), (size,)).query("method == 'hippo'")
        times = [PAPER_TABLE_2[graph].hitting_time for graph in cells["graph"]]
        for place, quantity in zip(axes[0], ("success", "length"), strict=True):
            for column, label, color in ((quantity, "ours", COLOURS[0]), (f"paper_{quantity}", "paper", COLOURS[1])):
                place.scatter(times, cells[column], s=14, color=color, label=label)
                for x, y, graph in zip(times, cells[column], cells["graph"], strict=True):
                    is_above = quantity == "length"  # our values are low for length, and high for success
                    offset = {"xytext": (0, 4 if is_above else -4), "va": "bottom" if is_above else "top"}
                    place.annotate(graph, (x, y), textcoords="offset points", ha="center", fontsize=7, **offset)
            place.set_ylabel("success (%)" if quantity == "success" else "length (% of 1000)")
            place.set_ylim(-2, 104)
        return _labelled(figure, axes, "hitting time (paper, no drop)")


@dataclass(frozen=True)
class All:
    """Print Table 2 and Table 3 and draw all figures; train missing runs first."""

    runs: tyro.conf.OmitArgPrefixes[PaperRuns]

    def run(self) -> None:
        """Train, print and draw."""
        Table2().run()
        Table3(self.runs).run()
        for figure in (Figure3, *[Figure4] * ("c" in self.runs.graphs), Figure5):
            figure(self.runs).run()


def _limited(curves: Curves, goal: str) -> Curves:
    """Return curves in which an episode without the goal counts as one of `LIMIT` steps."""
    limited = {}
    for digest, curve in curves.items():
        share, steps = curve[f"achieved_{goal}"], curve[f"steps_to_{goal}"].fillna(0)
        limited[digest] = curve.assign(**{f"steps_to_{goal}": share * steps + (1 - share) * LIMIT})[share.notna()]
    return limited


def _draw_curve(axes: Axes, runs: pd.DataFrame, curves: Curves, name: str, scale: float, method: str) -> None:
    """Draw the mean over seeds and its 95% band; evaluations of different seeds are at most one update apart."""
    steps = curves_of(runs, curves)[0]["steps"].to_numpy()
    mean, half_width = mean_and_interval(scale * values_at(steps, runs, curves, name))
    number = list(METHODS).index(method)
    colour, dash = COLOURS[number], DASHES[number]
    axes.plot(steps / 1e6, mean, color=colour, linestyle=dash, linewidth=1.2, label=METHODS[method])
    axes.fill_between(steps / 1e6, mean - half_width, mean + half_width, color=colour, alpha=0.2, linewidth=0)


def _labelled(figure: Figure, axes: np.ndarray, label: str = "training steps (millions)") -> Figure:
    for place in axes.flat:
        place.grid(alpha=0.25, linewidth=0.5)
        place.spines[["top", "right"]].set_visible(False)
        place.tick_params(labelsize=7)
        place.yaxis.label.set_size(8)
    for place in axes[-1]:
        place.set_xlabel(label, fontsize=8)
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False, fontsize=8)
    return figure
