"""Write a report on training runs: ``python -m hierroom report RUN [RUN ...]``."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, count, zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from hierroom.support.cli import Flag, progress_bar, read_arguments, refuse_without
from hierroom.support.errors import InputError, one_line, require_number
from hierroom.support.files import delete, usable_path, write_atomically

if TYPE_CHECKING:
    from hierroom.lab.report.curves import Curves
    from hierroom.lab.report.runs import ReportedRun


_DASHES = ("solid", "dash", "dot", "dashdot")  # the page's names for `compare.style.DASHES`


@dataclass(frozen=True)
class ReportArguments:
    """Write a report on training runs: one HTML file that needs no network and no server.

    Args:
        runs: folders of runs, or folders that contain them, such as that of a sweep.
        out: the file to write or replace; by default a new one, report.html, report-2.html, ...
        by: entries of the config to group runs by: meta, or method,gamma; the default is that of compare.
        replays: number of runs with agents that play, the first of each group and graph; 0: none.
        episodes: episodes that the page replays of each such run; a success and a failure come first, if there are any.
        played: episodes of each such run that measure success and steps to each goal.
        seed: determines the levels and the actions; training never uses these levels, whatever its seed.
        greedy: let the controllers take their most probable actions instead of drawing them.
        trust_run: run custom code that a run's config names (a network, a reward, a meta-controller).
    """

    runs: Annotated[
        tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUNS", help_behavior_hint="(required)")
    ]
    out: Path | None = None
    by: str | None = None
    replays: int = 8
    episodes: int = 3
    played: int = 200
    seed: int = 0
    greedy: Flag = False
    trust_run: Flag = False


def main(argv: Sequence[str]) -> int:
    """Run the command with its arguments."""
    arguments = read_arguments(ReportArguments, "report", argv)
    if not arguments.runs:
        raise InputError("give the folders of the runs, or a folder that contains them")
    bounds = {"replays": (0, 1000), "episodes": (1, 20), "played": (1, 10**6), "seed": (0, 2**63 - 1)}
    for name, (least, most) in bounds.items():
        require_number(name, getattr(arguments, name), least, most, is_whole=True)
    refuse_without(arguments, "replays", "episodes", "played", "seed", "greedy")
    out = usable_path(arguments.out or Path("report.html"))
    if out.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"a report is an .html file, not {out}")
    if not out.parent.is_dir():
        raise InputError(f"cannot write {out}: there is no folder {out.parent}")
    page, notes = _page(arguments)
    if arguments.out is None:
        out = _claim(out)
    try:
        write_atomically(out, page)
    except BaseException:  # also Ctrl-C: no empty report stays
        if arguments.out is None:
            delete(out)
        raise
    for note in notes:
        print(one_line(f"- {note}"))  # a note may quote the name of a folder, which is untrusted
    print(f"{out} ({len(page) / 1e6:.1f} MB); open it in a browser")
    return 0


def _claim(path: Path) -> Path:
    several = (path.with_stem(f"{path.stem}-{number}") for number in count(2))
    for one in chain([path], several):
        with suppress(FileExistsError):
            one.touch(exist_ok=False)  # each process gets another file
            break
    return one


def _page(arguments: ReportArguments) -> tuple[bytes, list[str]]:
    import torch  # this and the next imports are slow, and --help does not need them

    from hierroom import Rules, __version__
    from hierroom.lab.compare.curve import METRICS
    from hierroom.lab.compare.evaluated_run import known_metrics
    from hierroom.lab.compare.style import line_style
    from hierroom.lab.compare.tasks import common_kind
    from hierroom.lab.report.curves import (
        compare_runs,
        complexities,
        curve_rows,
        known_measures,
        learning_points,
        run_rows,
    )
    from hierroom.lab.report.page import page_texts, render_page
    from hierroom.lab.report.replay import TILES
    from hierroom.lab.report.runs import read_runs
    from hierroom.worlds.dependencies import rules_by_goal

    torch.set_num_threads(1)  # as in training
    with progress_bar() as bar:
        task = bar.add_task("reading", total=1)
        runs, notes = read_runs(arguments.runs)
        bar.update(task, description="comparing", total=len(METRICS))
        curves = compare_runs(runs, arguments.by, lambda: bar.advance(task))
        untried, goals, replays, films = deque(_in_turn(runs, curves)), [], [], []
        rules: dict[str, Rules] = {}  # of tasks that played; others are not imported
        n_played = min(len(untried), arguments.replays) * arguments.played
        bar.update(task, description="playing", total=n_played, completed=0)
        while untried and (n := len(replays) + len(films)) < arguments.replays:
            one = untried.popleft()
            done = n * arguments.played
            if played := _play(one, arguments, notes, lambda n, done=done: bar.update(task, completed=done + n)):
                row, episodes, world = played
                if isinstance(world.rules, Rules):
                    has_target, name = world.goals.has_target, world.variants[0]
                    by_goal = {f"{name}: {goal}": own for goal, own in rules_by_goal(world.rules).items()}
                    rules |= {name: world.rules} if has_target else by_goal
                if len(world.goals):
                    goals.append({"run": one.name, "group": curves.group_of[str(one.path)], **row})
                (replays if one.config.env.task is None else films).append({"run": one.name, "episodes": episodes})
        bar.update(task, description="computing complexity", total=None)
        complexity, too_large = complexities(runs, rules)
    notes += [*curves.notes, *too_large]
    if arguments.replays and (n := len(replays) + len(films)) < len(runs):
        more = "; --replays N plays more" if untried else ""
        notes.append(f"episodes were played by {n} of {len(runs)} runs{more}")
    points = learning_points(curves)
    data = {
        "tiles": TILES,
        "groups": [
            {"label": label, "colour": colour, "dash": _DASHES[dash]}
            for label, (colour, dash) in zip(curves.labels, map(line_style, count()), strict=False)
        ],
        "metrics": [
            {"name": name, "label": METRICS[name].label, "is_rate": METRICS[name].is_rate}
            for name in known_metrics(one.evaluated for one in runs if one.evaluated is not None)
        ],
        "curves": curve_rows(curves),
        "runs": run_rows(runs, curves),
        "kind": common_kind(one.config.env.kind for one in runs),
        "measures": known_measures(complexity),
        "complexity": complexity,
        "points": points,
        "goals": goals,
        "is_greedy": arguments.greedy,
        "replays": replays,
    }
    groups = curves.labels
    only = runs[0] if len(runs) == 1 else None
    several = f"{len(runs)} runs in {len(groups)} group{'s' * (len(groups) > 1)}: {'; '.join(groups)}"
    texts = {
        **page_texts(runs, curves, complexity, points, notes),
        "title": only.name if only else f"hierroom: {len(runs)} runs",
        "summary": only.config.title_on(only.names) if only else several,
        "version": __version__,
        "films": films,
    }
    return render_page(texts, data), notes


def _in_turn(runs: Sequence[ReportedRun], curves: Curves) -> list[ReportedRun]:
    firsts: dict[int, dict[tuple[str, ...], ReportedRun]] = {}
    for one in runs:
        firsts.setdefault(curves.group_of[str(one.path)], {}).setdefault(tuple(one.graphs or one.names), one)
    in_turn = zip_longest(*(of_group.values() for of_group in firsts.values()))
    return [one for group in in_turn for one in group if one is not None]


def _play(
    one: ReportedRun, arguments: ReportArguments, notes: list[str], progress: Callable[[int], object]
) -> tuple[dict[str, Any], list[Any], Any] | None:
    """Return the goals that a run's agents achieve, some episodes, and their world.

    None, with a note, if they cannot play.
    """
    from hierroom.agents.evaluation import evaluate
    from hierroom.lab.report.curves import goal_row, training_goals
    from hierroom.lab.report.replay import replays
    from hierroom.runs.folder.run_folder import RunFolder
    from hierroom.runs.trained_agent import load

    try:
        agent = load(one.path, greedy=arguments.greedy, trust=arguments.trust_run)
        num_envs = min(100, arguments.played)
        turns, pair = agent.turns(num_envs, seed=arguments.seed), agent.pair(num_envs, seed=arguments.seed)
        row = goal_row(evaluate(pair, turns, arguments.played, progress))
        episodes = replays(agent, arguments.episodes, arguments.seed)
        notes += dict.fromkeys(f"{one.name} has no film: {e['no_film']}" for e in episodes if e.get("no_film"))
    except InputError as error:
        notes.append(f"not played: {error}")
        return None
    try:
        training = training_goals(RunFolder(one.path))
    except InputError as error:
        training = None
        notes.append(f"the goals that training achieved are left out: {error}")
    return {**row, "training": training}, episodes, turns.world
