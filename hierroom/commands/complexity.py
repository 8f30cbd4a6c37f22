"""Command line: how hard goal graphs are to explore."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any

import tyro

from hierroom.complexity.chains.walk import PAPER_WALK, TABLE_READING, Reading, Walk
from hierroom.complexity.graph_set import GraphSet
from hierroom.complexity.report import analyze
from hierroom.complexity.tables import COLUMNS, ColumnName, list_text, report_cells, value_of
from hierroom.complexity.walk_report import WalkReport
from hierroom.goals import NAMED_GRAPHS, GoalGraph, GraphSpecs, Rules, graph_specs, is_graph_set
from hierroom.support.cli import Flag, given, read_arguments
from hierroom.support.errors import InputError
from hierroom.support.files import to_json
from hierroom.support.output import said_in_turn, said_when_slow, warn
from hierroom.support.tables import named_table, print_table
from hierroom.worlds.env_config import GRAPHS, LAYOUTS
from hierroom.worlds.escape_room.level_map import as_maps
from hierroom.worlds.make import find_task

MAX_LISTED_ROOMS = 8  # with 612 goal graphs; the 1,747 of 9 rooms would take most of a minute
FORMATS = ("json", "csv", "latex", "markdown")
OF_PLAY = ("episodes", "size", "max_steps", "trust_run")  # options of --from-play alone
WITH_RULES = ("sort", *FORMATS, "draw", "walk")  # options that --rules and --task allow
WITH_PLAY = ("graph", "layout", "drop", "walk", "reading", "json", "draw", *OF_PLAY, "seed")
WITH_PLAYED_RULES = ("task", "graph", "layout", "drop", "walk", "from_play", "out", "json", "draw", *OF_PLAY, "seed")


@dataclass(frozen=True)
class ComplexityArguments:
    """Measure how hard goal graphs are to explore, before training: depth, width and passage times.

    Give one graph, or one file of rules, for its full report, or several for a list. By default the paper's seven
    graphs are listed.

    Args:
        rules: TOML files of rules, dependencies of any kind, instead of goal graphs; see hierroom.Rules.
        task: a task instead, by its rules: package.module:name of a hierroom.Task, or a built-in world.
        graph: letters from a to g, names such as keys-0-1-exit-2 (the room of each key, and of the exit), TOML files,
            rooms:N for every graph of N rooms, 2 to 8, hitting_time:LOW..HIGH or expected_steps:LOW..HIGH.
        layout: your own levels instead, as paths of text maps (see train); each gives its goal graph.
        exclude: goal graphs to leave out, in the same forms; they may have any number of rooms.
        all: list the paper's seven graphs.
        drop: let the controller drop keys.
        sort: sort the list by this column in ascending order.
        json: print everything that the reports contain as JSON.
        csv: print the list as CSV.
        latex: print the list as a LaTeX table, for the package booktabs.
        markdown: print the list as a Markdown table.
        draw: draw the goals, with their augmented graph or marking chain if it is not too large, or --from-play's reach
            curves, into this .png, .pdf or .svg file.
        walk: probabilities of one step of the assumed walk: to stay, to move, to start again.
        reading: interpretation of the paper's augmented graph. KEYS: from where a key is picked up (accessible, way to
            the start, own room). ROOMS: where a room leads (accessible, neighbours, through the start). DROP: where
            dropping a key leads (accessible, key room, start).
        from_play: measure the chain from play instead of assuming the random walk. Give a run's folder for its trained
            agents, random for random actions, or oracle for shortest solutions; by default on the run's graph, or c.
            With --task or --out: estimate from play which goals need which others, an upper bound of the true needs.
        out: with --from-play, write the rules that play showed into this .toml file.
        size: cells of the grid's side in play; by default the run's, or 19 for random and oracle.
        max_steps: steps after which an episode of play is truncated; by default the run's, or 1000.
        episodes: number of episodes to play.
        seed: seed of the levels, the actions and the bootstrap.
        trust_run: run custom code that the run's config names (a network, a reward, a meta-controller).
    """

    rules: tuple[Path, ...] = ()
    task: str | None = None
    graph: Annotated[GraphSpecs, GRAPHS] = ()
    layout: Annotated[Any, LAYOUTS] = ()
    exclude: Annotated[GraphSpecs, GRAPHS] = ()
    all: Flag = False
    drop: Flag = False
    sort: ColumnName | None = None
    json: Flag = False
    csv: Flag = False
    latex: Flag = False
    markdown: Flag = False
    draw: Path | None = None
    walk: Annotated[tuple[float, float, float], tyro.conf.arg(metavar="STAY MOVE RESTART")] = astuple(PAPER_WALK)
    reading: Annotated[tuple[str, str, str], tyro.conf.arg(metavar="KEYS ROOMS DROP")] = astuple(TABLE_READING)
    from_play: str | None = None
    out: Path | None = None
    size: int | None = None
    max_steps: int | None = None
    episodes: int = 1000
    seed: int = 0
    trust_run: Flag = False

    def allow_only(self, names: Sequence[str], what: str, subject: Sequence[str] = ()) -> None:
        """Refuse other options than ``names`` and those that ``what``, the beginning of the message, is about."""
        for entry in fields(self):
            if entry.name not in (*names, *subject) and getattr(self, entry.name) != entry.default:
                allowed = ", ".join(f"--{name}" for name in names)
                raise InputError(f"{what} only {allowed}, not --{entry.name}".replace("_", "-"))


def show(options: ComplexityArguments) -> None:
    """Print or draw the results for the options."""
    formats = [name for name in FORMATS if getattr(options, name)]
    if len(formats) > 1:
        raise InputError(f"choose one of {', '.join(f'--{name}' for name in FORMATS)}, not {len(formats)}")
    walk, reading = Walk(*options.walk), Reading(*options.reading)
    if options.draw is not None:
        from hierroom.support.sheet import picture_file  # matplotlib loads slowly, and few commands draw

        picture_file(options.draw)  # check it before long play or computation
    if options.out is not None and options.from_play is None:
        raise InputError("--out writes the rules that play showed, and goes with --from-play, which is missing")
    if options.from_play is not None and (options.task is not None or options.out is not None):
        _show_played_rules(options, options.from_play, walk)
        return
    if options.rules or options.task is not None:
        options.allow_only(WITH_RULES, f"--{'rules' if options.rules else 'task'} allows", ("rules", "task"))
        rules = [*map(Rules.from_toml, options.rules), *([] if options.task is None else [_rules_of(options.task)])]
        reports = [analyze(one, walk=walk) for one in rules]
        _show_reports(options, reports, len(reports) > 1)
        return
    if options.from_play is not None:
        _show_play(options, options.from_play, walk, reading)
        return
    if any(getattr(options, name) != getattr(ComplexityArguments, name) for name in (*OF_PLAY, "seed")):
        options_of_play = "--episodes, --seed, --size, --max-steps and --trust-run"
        raise InputError(f"{options_of_play} go with --from-play, which is missing")
    maps = as_maps(options.layout)
    specs = graph_specs(options.graph)
    if bool(specs) + bool(maps) + options.all > 1:
        raise InputError("choose graphs by only one of --graph, --layout and --all, not by several")
    specs = specs or tuple(one.graph for one in maps) or tuple(NAMED_GRAPHS)
    if reading.drop != TABLE_READING.drop and not options.drop:
        warn("DROP of --reading has no effect without --drop")
    chosen = GraphSet(specs, options.exclude, options.drop, MAX_LISTED_ROOMS, walk, reading)
    for note in chosen.notes:
        warn(note)
    reports = [analyze(graph, options.drop, walk, reading) for graph in chosen.graphs]
    _show_reports(options, reports, len(specs) > 1 or any(map(is_graph_set, specs)))


def _rules_of(task: str) -> Rules | GoalGraph:
    found: Any = find_task(task)
    rules = getattr(found, "rules", None)
    if rules is None:
        raise InputError(f"the task {task!r} declares no rules, from which its complexity would follow")
    return replace(rules, label=found.name)


def _show_reports(options: ComplexityArguments, reports: Sequence[WalkReport], is_list: bool) -> None:
    if options.draw is not None and len(reports) != 1:
        raise InputError(f"--draw draws one graph, named by --graph, or one file of --rules, not {len(reports)}")
    if options.sort is not None and len(reports) == 1:
        warn("--sort has no effect, as there is one report")
    if is_list:
        for report in said_in_turn(f"measuring {len(reports)} goal graphs or sets of rules", reports):
            report_cells(report)  # the report keeps its numbers
    if (column := options.sort) is not None:
        reports = sorted(reports, key=lambda report: value_of(report, column))
    if options.draw is not None:
        with said_when_slow(f"drawing {reports[0].nodes:,} nodes"):
            reports[0].draw(options.draw)
    formats = [name for name in FORMATS if getattr(options, name)]
    if options.json:
        tables = [report.to_dict() for report in reports]
        print(to_json(tables if is_list else tables[0]))
    elif formats:
        print(list_text(reports, formats[0]), end="")
    elif is_list:
        _print_table(options, reports)
    else:
        print(reports[0])


def main(argv: Sequence[str]) -> int:
    """Run the command with its arguments."""
    show(read_arguments(ComplexityArguments, "complexity", argv))
    return 0


def _show_play(options: ComplexityArguments, player: str, walk: Walk, reading: Reading) -> None:
    options.allow_only(WITH_PLAY, "--from-play measures one goal graph and allows", ("from_play",))
    specs = graph_specs(options.graph)
    if len(specs) + len(options.layout) > 1 or any(map(is_graph_set, specs)):
        raise InputError("--from-play measures one goal graph, not several")
    from hierroom.lab.measure import measure_named  # imports the world and the learners

    entries = given(options, "layout", "size", "max_steps") | ({"graph": specs[0]} if specs else {})
    report = measure_named(
        player, entries, options.drop, options.episodes, options.seed, walk, reading, options.trust_run
    )
    if options.draw is not None:
        from hierroom.complexity.drawing.draw_reach import figure_of_reach
        from hierroom.support.sheet import save_figure

        save_figure(figure_of_reach(report), options.draw)
    print(to_json(report.to_dict()) if options.json else report)


def _show_played_rules(options: ComplexityArguments, player: str, walk: Walk) -> None:
    options.allow_only(WITH_PLAYED_RULES, "rules from play allow")
    if options.out is not None and (options.out.suffix != ".toml" or not options.out.parent.is_dir()):
        raise InputError(f"rules are written to a .toml file in a folder that is there, not to {options.out}")
    from hierroom.lab.measure import play_rules_named  # imports the world and the learners

    specs = graph_specs(options.graph)
    if len(specs) > 1:
        raise InputError(f"rules are estimated from play in one goal graph, not in {len(specs)}")
    entries = given(options, "task", "layout", "size", "max_steps") | ({"graph": specs[0]} if specs else {})
    found = play_rules_named(player, entries, options.drop, options.episodes, options.seed, options.trust_run)
    seen = {"episodes": found.episodes, "seen": dict(found.seen)}
    if not options.json:
        print(found)
    elif not found.ways:
        print(to_json(seen))
    rules = found.rules_to(found.furthest)
    if rules.target != found.target:
        warn(f"{found.missed(found.target)}. The rules are those of {rules.target!r}, which was achieved least often")
    if options.json:
        print(to_json(seen | rules.to_dict()))
    if options.out is not None:
        # before the report, which may refuse rules that long play has found
        rules.to_toml(options.out)
        print(options.out, file=sys.stderr if options.json else sys.stdout)
    if not options.json or options.draw is not None:
        report = analyze(rules, walk=walk)
        if not options.json:
            print(f"\n{report}")
        if options.draw is not None:
            report.draw(options.draw)


def _print_table(options: ComplexityArguments, reports: Sequence[WalkReport]) -> None:
    plural, drop = "s" * (len(reports) > 1), "with" if options.drop else "without"
    title = f"{len(reports)} goal graph{plural}, {drop} drop"
    if options.rules:
        title = f"{len(reports)} sets of rules"
    headings = [heading for heading, _ in COLUMNS.values()]
    table = named_table(headings, map(report_cells, reports), title=title, padding=0)  # no padding, as names are long
    table.columns[0].no_wrap = True
    print_table(table)
    restart = options.walk[2]
    print(f"hitting time: the paper's (Table 2){f', saturates near {1 / restart:.4g}' if restart else ''}")
    print("expected steps, std: first passage of the same walk to the exit")
