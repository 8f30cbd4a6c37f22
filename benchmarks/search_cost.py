"""Cost of searching: a controller that remembers all it saw against one that sees the whole level.

    python -m benchmarks.search_cost --episodes 1000

Both are given the same goals in the levels in which runs are evaluated; see `searching.py` for the one that has to look
for them. The table has mean lengths, first that of the shortest ways to the exit, for which no goals are given.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console
from rich.progress import track

from benchmarks.informed import Informed
from benchmarks.result_table import ResultTable
from benchmarks.searching import Searching
from hierroom.agents.evaluation import evaluate
from hierroom.goals import spec_names
from hierroom.meta import make_meta
from hierroom.runs.assembly import derived_seed, make_turns
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.presets import find_preset
from hierroom.runs.trainer import MAX_EVALUATION_ENVS
from hierroom.support.cli import run
from hierroom.support.errors import InputError


@dataclass(frozen=True)
class Options:
    """Play the same levels with the informed and the searching controller."""

    graphs: tuple[str, ...] = ("a", "b", "c", "d", "e", "f", "g")
    """Goal graphs to play."""
    episodes: int = 1000
    """Episodes of each."""
    meta: str = "fixed-dfs"
    """The meta-controller; not a learned one."""
    size: int = 19
    """Cells of the grid's side."""
    seed: int = 0
    """The levels are those in which a run of this seed is evaluated."""
    out: Path | None = None
    """A file that the table is written to as CSV."""


HEADINGS = ("graph", "shortest", "informed", "searching", "over informed", "success")


def row_of(config: TrainConfig, episodes: int) -> tuple[str, ...]:
    """Return the table's row for the environments of a config."""
    num_envs, seed = min(MAX_EVALUATION_ENVS, episodes), derived_seed(config.seed, "evaluation")
    meta = config.resolved_method.meta
    turns = make_turns(config, num_envs, seed, levels="evaluation", measure_shortest=True)
    informed = evaluate(Informed(make_meta(meta), num_envs), turns, episodes)
    turns = make_turns(config, num_envs, seed, levels="evaluation")
    searching = evaluate(Searching(make_meta(meta), turns), turns, episodes)
    shortest = informed.length / informed.length_over_shortest
    (graph,) = spec_names(config.env.graph)
    lengths = (f"{length:.1f}" for length in (shortest, informed.length, searching.length))
    return graph, *lengths, f"{searching.length / informed.length:.2f}", f"{searching.success_rate:.1%}"


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__, config=(tyro.conf.OmitArgPrefixes,))
    config = find_preset("default").changed(meta=options.meta, seed=options.seed, threads=1)
    if options.episodes < 1:
        raise InputError(f"episodes must be at least 1, not {options.episodes}")
    graphs = track(options.graphs, "graphs", console=Console(stderr=True), transient=True)
    rows = tuple(row_of(config.changed(graph=graph, size=options.size), options.episodes) for graph in graphs)
    ResultTable(HEADINGS, rows).publish(options.out)
    return 0


if __name__ == "__main__":
    run(main)
