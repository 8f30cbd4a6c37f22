"""Cost of each measure on the paper's graphs, on all goal graphs of five rooms and of up to five, and in levels.

    python -m benchmarks.measure_speed

Each time is CPU time of one thread, so that other processes do not lengthen it. It is the median of some repeats after
a warm-up, with the spread from the least to the greatest. For a set of graphs it is the sum over the graphs. Levels are
measured once each.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table

from hierroom.complexity import GraphSet, analyze
from hierroom.complexity.chains.ergodic import MAX_COVER_NODES
from hierroom.complexity.measures import (
    DeterministicMDP,
    Gorp,
    committor,
    commute_time,
    cover_time,
    covering_length,
    effective_horizon,
    effective_planning_window,
    graph_mdp,
    mdp_policy_information,
    minimum_k,
    mixing_time,
    sampled_cover_time,
    spectral_gap,
    stationary_distribution,
)
from hierroom.complexity.report import ComplexityReport
from hierroom.goals import NAMED_GRAPHS, GoalGraph
from hierroom.runs.folder.provenance import cpu_name
from hierroom.worlds.escape_room.measured_levels import GORP_RUNS, LEVEL_POLICIES, level_mdp


@dataclass(frozen=True)
class Options:
    """Time every measure.

    Args:
        repeats: times each is measured on goal graphs.
        horizon: steps of an episode on goal graphs.
        level_horizon: steps of an episode in levels; 0 leaves levels out.
    """

    repeats: int = 3
    horizon: int = 20
    level_horizon: int = 1000


def of_mdp(horizon: int, policies: int, runs: int | None) -> dict[str, Callable[[DeterministicMDP], object]]:
    return {
        "random success": lambda mdp: mdp.random_success(horizon),
        "least k": lambda mdp: minimum_k(mdp, horizon),
        "bound on the effective horizon": lambda mdp: effective_horizon(mdp, horizon),
        "GORP's m_1": lambda mdp: Gorp(mdp, horizon, runs=runs).rollouts(),
        "planning window": lambda mdp: effective_planning_window(mdp, horizon),
        "covering length": lambda mdp: covering_length(mdp, horizon),
        f"PIC and POIC, {policies} policies": lambda mdp: mdp_policy_information(mdp, horizon, policies),
    }


def cover(report: ComplexityReport) -> object:
    weights = report.chain.weights
    return cover_time(weights, 0) if report.nodes <= MAX_COVER_NODES else sampled_cover_time(weights, 0)


OF_WALK: dict[str, Callable[[ComplexityReport], object]] = {
    "augmented graph": lambda report: analyze(report.graph).chain,
    "hitting time, the paper's": lambda report: replace(report.chain).hitting_time,  # a copy has computed nothing yet
    "expected steps": lambda report: replace(report.chain).expected_steps,
    "standard deviation": lambda report: replace(report.chain).std,
    "stationary distribution": lambda report: stationary_distribution(report.chain.weights),
    "spectral gap": lambda report: spectral_gap(report.chain.weights),
    "mixing time": lambda report: mixing_time(report.chain.weights),
    "commute time": lambda report: commute_time(report.chain.weights, 0, report.augmented.exit),
    "committor": lambda report: committor(report.chain.weights, 0, report.augmented.exit),
    "cover time": cover,
}


def seconds(run: Callable[[], object]) -> float:
    started = time.process_time()
    run()
    return time.process_time() - started


def total(measure: Callable, items: Sequence, repeats: int) -> str:
    measure(items[0])
    sums = [sum(seconds(lambda item=item: measure(item)) for item in items) for _ in range(repeats)]
    low, middle, high = (1e3 * f(sums) for f in (min, np.median, max))
    return f"{middle:.1f} ms ({low:.1f}-{high:.1f})"


def time_graphs(options: Options) -> Table:
    sets = {"a-g": GraphSet(tuple(NAMED_GRAPHS)).graphs}
    sets["5 rooms"] = GraphSet("rooms:5").graphs
    sets["up to 5 rooms"] = GraphSet(("rooms:2", "rooms:3", "rooms:4", "rooms:5")).graphs
    reports = {name: [analyze(graph) for graph in graphs] for name, graphs in sets.items()}
    table = Table(
        title=f"{cpu_name()}, CPU time of one thread, Python "
        f"{platform.python_version()}; horizon {options.horizon}; median of {options.repeats} (least-greatest)"
    )
    table.add_column("measure")
    for name, its in reports.items():
        table.add_column(f"{name}: {len(its)} graphs", justify="right")
    mdps = {name: [graph_mdp(report.augmented) for report in its] for name, its in reports.items()}
    for measure, run in OF_WALK.items():
        table.add_row(measure, *(total(run, its, options.repeats) for its in reports.values()))
    for measure, run in of_mdp(options.horizon, 200, None).items():
        table.add_row(measure, *(total(run, its, options.repeats) for its in mdps.values()))
    return table


def time_levels(options: Options) -> Table:
    graphs: list[GoalGraph] = list(NAMED_GRAPHS.values())
    measures = of_mdp(options.level_horizon, LEVEL_POLICIES, GORP_RUNS)
    table = Table(title=f"one level of each graph, horizon {options.level_horizon}; CPU seconds, measured once")
    for heading in ("graph", "states", "enumeration", *measures):
        table.add_column(heading, justify="right")
    for run in measures.values():  # compile
        run(level_mdp(graphs[0], 0, size=11))
    level_mdp(graphs[0], 0)
    for graph in track(graphs, "measuring", console=Console(stderr=True), transient=True):
        enumeration = seconds(lambda graph=graph: level_mdp(graph, 0))
        mdp = level_mdp(graph, 0)
        times = [seconds(lambda run=run, mdp=mdp: run(mdp)) for run in measures.values()]
        table.add_row(graph.name, f"{mdp.n_states:,}", *(f"{spent:.2f}" for spent in (enumeration, *times)))
    return table


def main(options: Options) -> None:
    console = Console(width=150)
    console.print(time_graphs(options))
    if options.level_horizon:
        console.print(time_levels(options))


if __name__ == "__main__":
    main(tyro.cli(Options))
