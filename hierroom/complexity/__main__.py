"""Command line: how hard goal graphs are to explore."""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from hierroom.cli import program, run, words
from hierroom.complexity.graph_set import GraphSet
from hierroom.complexity.report import ComplexityReport, analyze
from hierroom.env_config import GRAPHS
from hierroom.errors import InputError
from hierroom.files import to_json
from hierroom.goals import NAMED_GRAPHS, GoalGraph, GraphSpecs, graph_specs, is_graph_set

MAX_LISTED_ROOMS = 8
"""There are 612 goal graphs of 8 rooms. The 1,747 of 9 rooms would take most of a minute."""

ColumnName = Literal["graph", "exit_depth", "width", "nodes", "edges", "hitting_time", "expected_steps", "std"]


@dataclass(frozen=True)
class Column:
    """A column of the list of graphs: its heading, its value, and the format in which it is printed."""

    heading: str
    value: Callable[[ComplexityReport], Any]
    style: str = ""


COLUMNS: Mapping[ColumnName, Column] = {
    "graph": Column("graph", lambda report: report.graph.name),
    "exit_depth": Column("exit\ndepth", lambda report: report.exit_depth),
    "width": Column("width", lambda report: report.width),
    "nodes": Column("nodes", lambda report: report.nodes),
    "edges": Column("edges", lambda report: report.edges),
    "hitting_time": Column("hitting\ntime", lambda report: report.hitting_time, ".2f"),
    "expected_steps": Column("expected\nsteps", lambda report: report.expected_steps, ".1f"),
    "std": Column("std", lambda report: report.std, ".1f"),
}


@dataclass(frozen=True)
class ComplexityArguments:
    """How hard goal graphs are to explore, before training: depth, width and passage times.

    Give one graph for its full report, or several for a list. By default the paper's seven graphs are listed.

    Args:
        graph: letters from a to g, paths to .toml files, rooms:N for every graph of N rooms, 2 to 8, and
            hitting_time:LOW..HIGH or expected_steps:LOW..HIGH for all graphs in that interval.
        exclude: goal graphs to leave out, given likewise and found however their rooms are numbered.
        all: list the paper's seven graphs.
        drop: let the controller drop keys.
        sort: sort the list by this column in ascending order.
        json: print everything that the reports contain as JSON.
        csv: print the list as CSV.
        draw: draw the goal graph and its augmented graph into this .png, .pdf or .svg file.
        from_play: measure the chain from play instead of assuming the random walk. Give a run's folder to let its
            trained agents play, random for random actions, or oracle for shortest solutions. Without --graph the goal
            graph is that of the run, or c for random and oracle.
        measures: list the measures of the literature instead, such as the effective horizon and the covering length, on
            the MDP whose states are the nodes of the augmented graph.
        levels: with --measures, measure so many levels of each graph by their exact states instead.
        horizon: with --measures, steps of an episode: by default 20 on goal graphs and 1000 in levels.
        episodes: how many episodes to play.
        seed: seed of the levels, the actions and the bootstrap.
    """

    graph: Annotated[GraphSpecs, GRAPHS] = ()
    exclude: Annotated[GraphSpecs, GRAPHS] = ()
    all: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    drop: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    sort: ColumnName | None = None
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    csv: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    draw: Path | None = None
    from_play: str | None = None
    measures: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    levels: int = 0
    horizon: int | None = None
    episodes: int = 1000
    seed: int = 0


def show(options: ComplexityArguments) -> None:
    """Print or draw what the options ask for.

    Raises:
        InputError: if the options contradict each other or one of them is not valid.
    """
    if options.json and options.csv:
        raise InputError("choose one of --json and --csv, not both")
    if options.from_play is not None:
        _show_play(options, options.from_play)
        return
    has_seed = options.seed != ComplexityArguments.seed and not options.levels
    if has_seed or options.episodes != ComplexityArguments.episodes:
        raise InputError("--episodes and --seed go with --from-play, which is missing, or --seed with --levels")
    if (options.levels or options.horizon is not None) and not options.measures:
        raise InputError("--levels and --horizon go with --measures, which is missing")
    specs = _specs(options)
    graphs = GraphSet(specs, options.exclude, options.drop, MAX_LISTED_ROOMS).graphs
    if options.measures:
        _show_measures(options, graphs)
        return
    reports = [analyze(graph, options.drop) for graph in graphs]
    if options.sort is not None:
        reports.sort(key=COLUMNS[options.sort].value)
    is_list = len(specs) > 1 or any(map(is_graph_set, specs))
    if options.draw is not None:
        _draw(reports, options.draw)
    if options.json:
        tables = [report.to_dict() for report in reports]
        print(to_json(tables if is_list else tables[0]))
    elif options.csv:
        _print_csv(reports)
    elif is_list:
        _print_table(reports)
    else:
        print(reports[0])


def main() -> int:
    """Run the command."""
    show(tyro.cli(ComplexityArguments, prog=program("complexity"), args=words()))
    return 0


def _specs(options: ComplexityArguments) -> tuple[GoalGraph | str, ...]:
    specs = graph_specs(options.graph)
    if specs and options.all:
        raise InputError("choose graphs by only one of --graph and --all, not by both")
    return specs or tuple(NAMED_GRAPHS)


def _draw(reports: list[ComplexityReport], path: Path) -> None:
    if len(reports) != 1:
        raise InputError(f"--draw draws one graph, named by --graph, not {len(reports)}")
    from hierroom.complexity.draw import draw_graph  # matplotlib loads slowly, and few commands draw

    draw_graph(reports[0].augmented, path)


def _show_play(options: ComplexityArguments, player: str) -> None:
    specs = graph_specs(options.graph)
    several = len(specs) > 1 or any(map(is_graph_set, specs)) or options.exclude or options.all
    if options.measures or options.levels or options.horizon is not None:
        raise InputError("choose one of --from-play and --measures, not both")
    if several or options.csv or options.sort or options.draw is not None:
        raise InputError(
            "--from-play measures one goal graph and allows only --graph, --drop, --json, --episodes and --seed"
        )
    from hierroom.measure import measure_named  # imported here, because it loads the world and the learners

    report = measure_named(player, specs[0] if specs else None, options.drop, options.episodes, options.seed)
    if options.json:
        print(to_json(report.to_dict()))
    else:
        print(report)


def _show_measures(options: ComplexityArguments, graphs: tuple[GoalGraph, ...]) -> None:
    if options.draw is not None or options.sort is not None:
        raise InputError("--measures allows neither --draw nor --sort")
    from hierroom.complexity.measures.graphs import measure_graphs
    from hierroom.complexity.measures.table import print_measures, print_measures_csv  # rich loads slowly

    horizon = options.horizon if options.horizon is not None else 1000 if options.levels else 20
    drop = "with" if options.drop else "without"
    if options.levels:
        from hierroom.measure.levels import measure_levels  # it loads the world

        measured = measure_levels(graphs, options.levels, horizon, options.drop, options.seed)
        title = f"levels of {len(graphs)} goal graphs, {drop} drop, horizon {horizon}"
    else:
        measured = measure_graphs(graphs, horizon, options.drop)
        title = f"MDPs of {len(graphs)} goal graphs, {drop} drop, horizon {horizon}"
    if options.json:
        print(to_json([graph.to_dict() for graph in measured]))
    elif options.csv:
        print_measures_csv(measured)
    else:
        print_measures(measured, title)


def _print_csv(reports: list[ComplexityReport]) -> None:
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(["key_rooms", "exit_room", "drop_key", *COLUMNS])
    for report in reports:
        graph = report.graph
        cells = [column.value(report) for column in COLUMNS.values()]
        writer.writerow(["-".join(map(str, graph.key_rooms)), graph.exit_room, report.drop_key, *cells])


def _print_table(reports: list[ComplexityReport]) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(
        title=f"{len(reports)} goal graphs, {'with' if reports[0].drop_key else 'without'} drop",
        box=SIMPLE_HEAD,
        padding=0,  # graphs of 8 rooms have long names, and the table must fit into 80 columns
    )
    for name, column in COLUMNS.items():
        table.add_column(column.heading, justify="left" if name == "graph" else "right", no_wrap=name == "graph")
    for report in reports:
        table.add_row(*(escape(format(column.value(report), column.style)) for column in COLUMNS.values()))
    Console().print(table)
    print("hitting time: the paper's (Table 2), saturates near 100")
    print("expected steps, std: first passage of the same walk to the exit")


def script() -> None:
    """The command, as ``hierroom-complexity``."""
    run(main)


if __name__ == "__main__":
    script()
