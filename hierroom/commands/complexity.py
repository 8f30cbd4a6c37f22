"""Command line: how hard goal graphs are to explore."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import tyro

from hierroom.complexity.chains.walk import PAPER_WALK, Walk
from hierroom.complexity.graph_set import GraphSet
from hierroom.complexity.report import ComplexityReport, analyze
from hierroom.complexity.walk_report import WalkReport, short
from hierroom.goals import NAMED_GRAPHS, GoalGraph, GraphSpecs, Rules, graph_specs, is_graph_set
from hierroom.support.cli import Flag, names_of, read_arguments
from hierroom.support.errors import InputError
from hierroom.support.files import to_json
from hierroom.support.output import said_in_turn, said_when_slow, warn
from hierroom.support.tables import csv_text, named_table, print_table
from hierroom.worlds.dependencies import rules_by_goal
from hierroom.worlds.env_config import GRAPHS, LAYOUTS
from hierroom.worlds.escape_room.level_map import as_maps
from hierroom.worlds.make import find_task

MAX_LISTED_ROOMS = 8  # with 612 goal graphs; the 1,747 of 9 rooms would take most of a minute
COLUMNS: Mapping[str, tuple[str, int]] = {
    "exit_depth": ("exit\ndepth", 0),
    "width": ("width", 0),
    "nodes": ("nodes", 0),
    "edges": ("edges", 0),
    "hitting_time": ("hitting\ntime", 2),
    "expected_steps": ("expected\nsteps", 1),
    "std": ("std", 1),
}
"""The columns of the table of graphs after their names, each with its heading and number of decimals."""
FIELDS: tuple[str, ...] = ("key_rooms", "exit_room", "drop_key", "graph", *COLUMNS)
"""The columns of `_rows_of`."""
_ONE_FORMAT = tyro.conf.create_mutex_group(required=False, title="formats, one at a time")
_ONE_SOURCE = tyro.conf.create_mutex_group(required=False, title="goal graphs, given in one way; by default all")


@dataclass(frozen=True)
class ListArguments:
    """Options that every input takes.

    Args:
        json: print everything that the reports contain as JSON.
        draw: draw the goals, of a goal graph also its augmented graph if it is not too large, into this .png, .pdf or
            .svg file.
        walk: probabilities of one step of the assumed walk: to stay, to move, to start again.
        csv: print the list as CSV.
    """

    json: Annotated[Flag, _ONE_FORMAT] = False
    draw: Path | None = None
    walk: Annotated[tuple[float, float, float], tyro.conf.arg(metavar="STAY MOVE RESTART")] = astuple(PAPER_WALK)
    csv: Annotated[Flag, _ONE_FORMAT] = False

    def print_reports(self, reports: Sequence[WalkReport], is_list: bool, title: str) -> None:
        """Print the reports in the chosen format, as a list or as one report, and draw a single one."""
        if self.draw is not None and len(reports) != 1:
            raise InputError(f"--draw draws one graph, named by --graph, or one file of --rules, not {len(reports)}")
        if is_list:
            for report in said_in_turn(f"measuring {len(reports)} goal graphs or sets of rules", reports):
                _cells(report)  # the report keeps its numbers
        if self.draw is not None:
            with said_when_slow(f"drawing {reports[0].nodes:,} nodes"):
                reports[0].draw(self.draw)
        if self.json:
            tables = [report.to_dict() for report in reports]
            print(to_json(tables if is_list else tables[0]))
        elif self.csv:
            print(csv_text(_rows_of(reports), FIELDS), end="")
        elif is_list:
            headings = ["graph", *(heading for heading, _ in COLUMNS.values())]
            table = named_table(headings, map(_cells, reports), title=title, padding=0)  # as names are long
            table.columns[0].no_wrap = True
            print_table(table)
            restart = self.walk[2]
            print(f"hitting time: the paper's (Table 2){f', saturates near {1 / restart:.4g}' if restart else ''}")
            print("expected steps, std: first passage of the same walk to the exit")
        else:
            print(reports[0])


@dataclass(frozen=True)
class GraphArguments(ListArguments):
    """Measure how hard goal graphs are to explore, before training: depth, width and passage times.

    Give one graph for its full report, or several for a list. By default the paper's seven graphs are listed. Other
    inputs, with options of their own (add --help): --rules FILE measures dependencies of any kind, and --task TASK the
    rules of a task.

    Args:
        graph: letters from a to g, names such as keys-0-1-exit-2 (the room of each key, and of the exit), TOML files,
            rooms:N for every graph of N rooms, 2 to 8, hitting_time:LOW..HIGH or expected_steps:LOW..HIGH.
        layout: your own levels instead, as paths of text maps (see train); each gives its goal graph.
        all: list the paper's seven graphs.
        exclude: goal graphs to leave out, in the same forms; they may have any number of rooms.
        drop: let the controller drop keys.
    """

    graph: Annotated[GraphSpecs, GRAPHS, _ONE_SOURCE] = ()
    layout: Annotated[Any, LAYOUTS, _ONE_SOURCE] = ()
    all: Annotated[Flag, _ONE_SOURCE] = False
    exclude: Annotated[GraphSpecs, GRAPHS] = ()
    drop: Flag = False

    def show(self) -> None:
        """Print or draw the reports on goal graphs."""
        walk = Walk(*self.walk)
        specs = graph_specs(self.graph) or tuple(one.graph for one in as_maps(self.layout)) or tuple(NAMED_GRAPHS)
        chosen = GraphSet(specs, self.exclude, self.drop, MAX_LISTED_ROOMS, walk)
        for note in chosen.notes:
            warn(note)
        reports = [analyze(graph, self.drop, walk) for graph in chosen.graphs]
        plural, drop = "s" * (len(reports) > 1), "with" if self.drop else "without"
        title = f"{len(reports)} goal graph{plural}, {drop} drop"
        self.print_reports(reports, len(specs) > 1 or any(map(is_graph_set, specs)), title)


@dataclass(frozen=True)
class RulesArguments(ListArguments):
    """Measure how hard it is to reach the target of rules, before training: depth, width and passage times.

    Args:
        rules: TOML files of rules, dependencies of any kind; see hierroom.Rules.
        task: a task, by its rules: package.module:name of a hierroom.Task, or a built-in world.
    """

    rules: tuple[Path, ...] = ()
    task: str | None = None

    def show(self) -> None:
        """Print or draw the reports on rules."""
        rules = [*map(Rules.from_toml, self.rules), *([] if self.task is None else _rules_of(self.task))]
        reports = [analyze(one, walk=Walk(*self.walk)) for one in rules]
        self.print_reports(reports, len(reports) > 1, f"{len(reports)} sets of rules")


def _rules_of(task: str) -> list[Rules | GoalGraph]:
    found: Any = find_task(task)
    rules = getattr(found, "rules", None)
    if rules is None:
        raise InputError(f"the task {task!r} declares no rules, from which its complexity would follow")
    rules = replace(rules, label=found.name)
    return [rules] if found.goal_set.has_target else [*rules_by_goal(rules).values()]


def _cells(report: WalkReport) -> list[str]:
    return [report.name, *(short(getattr(report, name), digits) for name, (_, digits) in COLUMNS.items())]


def _rows_of(reports: Iterable[WalkReport]) -> list[dict[str, Any]]:
    rows = []
    for report in reports:
        of_graph: dict[str, Any] = {"graph": report.name}
        if isinstance(report, ComplexityReport):
            rooms = "-".join(map(str, report.graph.key_rooms))
            of_graph |= {"key_rooms": rooms, "exit_room": report.graph.exit_room, "drop_key": report.drop_key}
        rows.append(of_graph | {name: getattr(report, name) for name in COLUMNS})
    return rows


ComplexityArguments = GraphArguments
"""The arguments that a shell completes: those of the usual input."""


def main(argv: Sequence[str]) -> int:
    """Run the command with the arguments of the kind of input that they name."""
    given_names = names_of(argv)
    option = next((name for name in ("--rules", "--task") if name in given_names), "")
    if {"-h", "--help"} & {*given_names}:
        argv = ["--help"]  # without the option, which may lack its value
    kind = RulesArguments if option else GraphArguments
    arguments = read_arguments(kind, f"complexity {option}".strip(), argv)
    if arguments.draw is not None:
        from hierroom.support.sheet import picture_file  # matplotlib loads slowly, and few commands draw

        picture_file(arguments.draw)  # check it before long computation
    arguments.show()
    return 0
