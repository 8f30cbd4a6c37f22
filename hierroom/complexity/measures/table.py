"""The measures of several goal graphs or levels as one table: on the terminal, as CSV, JSON, LaTeX or Markdown."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, TypeVar

from rich.console import Console
from rich.progress import track

from hierroom.complexity.chains.walk import PAPER_WALK, TABLE_READING, Reading, Walk
from hierroom.complexity.measures.effective_horizon import horizon_of
from hierroom.complexity.measures.mdp import graph_mdp
from hierroom.complexity.measures.summary import (
    MdpMeasures,
    SampledMeasures,
    WalkMeasures,
    measure_mdp,
    measure_walk,
)
from hierroom.complexity.report import analyze
from hierroom.goals import GoalGraph
from hierroom.support.tables import csv_text, latex_table, markdown_table, named_table, print_table

Item = TypeVar("Item")


@dataclass(frozen=True)
class MeasuredGraph:
    """The measures of one goal graph, or of one of its levels."""

    name: str
    mdp: MdpMeasures | SampledMeasures
    walk: WalkMeasures | None = None  # the assumed walk; None for a level

    def to_dict(self) -> dict[str, Any]:
        """Return the measures as plain numbers and strings."""
        return {"graph": self.name} | asdict(self.mdp) | (asdict(self.walk) if self.walk else {})

    @property
    def cells(self) -> list[str]:
        """The measures of the MDP as printed, in the order of `MDP_COLUMNS`; ``-`` for unknown ones."""
        columns = MDP_COLUMNS if isinstance(self.mdp, MdpMeasures) else SAMPLED_COLUMNS
        return [columns[name](self.mdp) if name in columns else "-" for name in MDP_COLUMNS]


MDP_COLUMNS: Mapping[str, Callable[[Any], str]] = {
    "states": lambda m: str(m.states),
    "steps": lambda m: str(m.shortest),
    "random": lambda m: f"{m.random_success:.2g}",
    "k": lambda m: str(m.k),
    "W": lambda m: str(m.planning_window),
    "bound": lambda m: f"{m.horizon_bound:.1f}",
    "H_1": lambda m: "-" if math.isinf(m.effective_horizon) else f"{m.effective_horizon:.2f}",
    "samples": lambda m: f"{m.samples:.1e}",
    "covering": lambda m: f"{_short(m.covering_low)}-{_short(m.covering_high)}",
    "PIC": lambda m: f"{m.pic:.2g}",
    "POIC": lambda m: f"{m.poic:.2g}",
}
SAMPLED_COLUMNS: Mapping[str, Callable[[Any], str]] = {
    "states": lambda m: "over 1e6" if m.states is None else str(m.states),
    "steps": MDP_COLUMNS["steps"],
    "random": lambda m: f"~{m.random_success:.2g}" if m.random_success else f"<{m.random_success_high:.1g}",
    "H_1": lambda m: (
        f">{horizon_of(1, m.rollouts_tried, m.actions):.1f}" if m.rollouts is None else f"~{m.effective_horizon:.1f}"
    ),
    "samples": lambda m: "-" if math.isinf(m.samples) else f"~{m.samples:.0e}",
    "PIC": lambda m: f"~{m.pic:.1g}" if m.pic else "-",
    "POIC": lambda m: f"~{m.poic:.1g}" if m.poic else "-",
}
WALK_COLUMNS: Mapping[str, Callable[[WalkMeasures], str]] = {
    "nodes": lambda w: str(w.nodes),
    "at exit": lambda w: f"{w.at_exit:.3f}",
    "escape": lambda w: f"{w.escape:.4f}",
    "spectral\ngap": lambda w: f"{w.spectral_gap:.4f}",
    "mixing": lambda w: f"{w.mixing:.0f}",
    "commute": lambda w: f"{w.commute:.1f}",
    "cover": lambda w: f"{w.cover:.0f}" + (f" +- {w.cover_error:.0f}" if w.cover_error else ""),
}
MDP_NOTES = """\
steps: of a shortest solution; random: success of the random policy
k: the MDP is k-QVI-solvable; W: effective planning window
bound: on the effective horizon, by theorem 5.4 of Laidlaw et al. (2023)
H_1 = 1 + log_A m_1, with the rollouts m_1 that GORP needs; - where m_1 > 10^6
samples: steps that GORP samples at most, T^2 A^H
covering: bounds on the covering length, in episodes; PIC, POIC: in nats"""
SAMPLED_NOTES = """\
~, <, >: estimated from rollouts, as these levels have too many states to compute
the rest; random: < the end of the 95% interval where no episode escaped"""
WALK_NOTES = """\
at exit: long-run share of the time
escape: chance, on leaving the start, of the exit before the start (committor)
mixing, commute, cover: in steps; cover +- standard error where it is sampled"""


def print_measures(measured: Sequence[MeasuredGraph], title: str) -> None:
    """Print the measures as tables of 80 columns."""
    _print(title, MDP_COLUMNS, [(graph.name, *graph.cells) for graph in measured])
    print(MDP_NOTES)
    if any(isinstance(graph.mdp, SampledMeasures) for graph in measured):
        print(SAMPLED_NOTES)
    walks = [(graph.name, *_walk_cells(graph.walk)) for graph in measured if graph.walk is not None]
    if walks:
        _print("the assumed walk", WALK_COLUMNS, walks)
        print(WALK_NOTES)


def measures_text(measured: Sequence[MeasuredGraph], form: str) -> str:
    """Return the measures as ``csv`` in full precision, or as a ``latex`` or ``markdown`` table, rounded as printed."""
    if form == "csv":
        return csv_text(graph.to_dict() for graph in measured)
    has_walk = all(graph.walk is not None for graph in measured)
    heads = ["graph", *MDP_COLUMNS, *(WALK_COLUMNS if has_walk else ())]
    rows = [[graph.name, *graph.cells, *(_walk_cells(graph.walk) if graph.walk else ())] for graph in measured]
    table = latex_table if form == "latex" else markdown_table
    return table([head.replace("\n", " ") for head in heads], rows) + "\n"


def _walk_cells(walk: WalkMeasures) -> list[str]:
    return [cell(walk) for cell in WALK_COLUMNS.values()]


def _print(title: str, columns: Iterable[str], rows: Iterable[Sequence[str]]) -> None:
    table = named_table(["graph", *columns], rows, title=title, padding=0)  # no padding, to fit into 80 columns
    table.columns[0].no_wrap = True
    print_table(table)


def _short(number: float) -> str:
    return f"{number:.0f}" if number < 10_000 else f"{number:.0e}".replace("e+0", "e").replace("e+", "e")


def measure_graphs(
    graphs: Sequence[GoalGraph],
    horizon: int = 20,
    drop_key: bool = False,
    walk: Walk = PAPER_WALK,
    reading: Reading = TABLE_READING,
) -> list[MeasuredGraph]:
    """Measure each goal graph as an MDP of ``horizon`` steps over its nodes, and as the assumed walk."""

    def measure(graph: GoalGraph) -> MeasuredGraph:
        report = analyze(graph.canonical(), drop_key, walk, reading)  # random draws depend on the order of the rooms
        mdp = measure_mdp(graph_mdp(report.augmented), horizon)
        return MeasuredGraph(graph.name, mdp, measure_walk(report.chain))

    return with_progress(measure, graphs)


def with_progress(measure: Callable[[Item], MeasuredGraph], items: Iterable[Item]) -> list[MeasuredGraph]:
    """Measure each item, with a progress bar that disappears."""
    console = Console(stderr=True)  # not shown in files, where the bar would leave an empty line
    tracked = track(list(items), "measuring", console=console, transient=True, disable=not console.is_terminal)
    return [measure(item) for item in tracked]
