"""Compare training runs: ``python -m hierroom compare RUNS --by meta``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from rich.console import Console
from rich.progress import Progress

from hierroom.lab.compare.metric import METRICS, MetricName
from hierroom.support.cli import read_arguments
from hierroom.support.errors import InputError, require_number
from hierroom.support.files import to_json, write_atomically
from hierroom.support.tables import csv_text, print_table

if TYPE_CHECKING:
    from hierroom.lab.compare.comparison import Comparison
    from hierroom.lab.compare.evaluated_run import EvaluatedRun

REPORT = "comparison.json"
"""The file by which the folder of an earlier comparison is known."""


@dataclass(frozen=True)
class CompareArguments:
    """Compare training runs by their evaluations: learning curves with bands, area under the curve, improvement.

    Writes curves.csv, summary.csv, improvement.csv, comparison.json, curves.pdf and curves.png.

    Args:
        runs: folders of runs, or folders that contain them.
        by: entries of the config that make a group, named as on the command line of training and joined by commas:
            meta, or method,gamma; or variant, the name that a sweep's plan gave. By default those
            that tell the runs apart, variant and method first; not seed, graph, steps, threads, device or evaluations.
        metric: what is compared, over the steps trained.
        out: the folder to write to: new, empty, or of an earlier comparison, which is replaced.
        resamples: resamples of the bootstrap.
        seed: fixes the resamples.
        json: print comparison.json instead of tables.
    """

    runs: Annotated[
        tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUNS", help_behavior_hint="(required)")
    ]
    by: str | None = None
    metric: MetricName = "success_rate"
    out: Path = Path("compare")
    resamples: int = 2000
    seed: int = 0
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False


def main(argv: Sequence[str]) -> int:
    """Run the command on its words."""
    arguments = read_arguments(CompareArguments, "compare", argv)
    if not arguments.runs:
        raise InputError("give the folders of the runs to compare, or a folder that contains them")
    require_number("resamples", arguments.resamples, 100, 10**6, is_whole=True)
    require_number("seed", arguments.seed, 0, 2**63 - 1, is_whole=True)
    _check_out(arguments.out)
    comparison, notes = _compared(arguments)
    report = _report(comparison, notes, arguments)
    written = _write(comparison, report, arguments.out)
    if arguments.json:
        print(to_json(report))
    else:
        _print(comparison, notes, written)
    return 0


def _check_out(out: Path) -> None:
    """Refuse a folder with files that are not of a comparison, before anything is computed."""
    is_free = not out.exists() or (out.is_dir() and ((out / REPORT).is_file() or not any(out.iterdir())))
    if not is_free:
        raise InputError(f"{out} is neither an empty folder nor that of an earlier comparison; choose another --out")


def _compared(arguments: CompareArguments) -> tuple[Comparison, list[str]]:
    """The comparison and the lines that go with it."""
    # These bring torch, scipy and matplotlib along, and --help needs none of them.
    from hierroom.lab.compare.caveats import caveats
    from hierroom.lab.compare.comparison import compare, n_estimates
    from hierroom.lab.compare.evaluated_run import find_runs, read_run, refuse_without_overlap
    from hierroom.lab.compare.figure import MAX_GROUPS
    from hierroom.lab.compare.grouping import differing_entries, entry_names, group_runs
    from hierroom.lab.compare.tasks import Tasks

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        paths, left_out = find_runs(arguments.runs)
        if not paths:
            raise InputError(f"no run in {', '.join(map(str, arguments.runs))} has evaluations")
        runs: list[EvaluatedRun] = list(bar.track(map(read_run, paths), len(paths), description="reading"))
        refuse_without_overlap(runs)
        by = differing_entries(runs) if arguments.by is None else entry_names(arguments.by)
        groups = group_runs(runs, by)
        if len(groups) > MAX_GROUPS:
            raise InputError(f"by {', '.join(by)} there are {len(groups)} groups; at most {MAX_GROUPS} can be compared")
        tasks = Tasks.common(groups)
        task = bar.add_task("estimating", total=n_estimates(groups, tasks))
        comparison = compare(
            groups, tasks, arguments.metric, arguments.resamples, arguments.seed, lambda: bar.advance(task)
        )
    notes = [f"left out, as it has no evaluations: {path}" for path in left_out]
    if arguments.by is None:
        notes.append(f"compared by {', '.join(by)}, as no --by was given")
    return comparison, notes + caveats(comparison)


def _report(comparison: Comparison, notes: Sequence[str], arguments: CompareArguments) -> dict[str, Any]:
    from hierroom.lab.compare.tables import improvement_rows, summary_rows

    return {
        "by": list(comparison.by),
        "metric": comparison.metric,
        "is_higher_better": METRICS[comparison.metric].is_higher_better,
        "graphs": list(comparison.tasks.graphs),
        "resamples": arguments.resamples,
        "seed": arguments.seed,
        "notes": list(notes),
        "groups": [
            {"group": group.label, **group.choices, "runs": [str(run.path) for run in group.runs]}
            for group in comparison.groups
        ],
        "summary": summary_rows(comparison),
        "improvement": improvement_rows(comparison),
    }


def _write(comparison: Comparison, report: dict[str, Any], out: Path) -> list[Path]:
    from hierroom.lab.compare.figure import draw_comparison
    from hierroom.lab.compare.tables import curve_rows, improvement_rows, summary_rows

    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot create the folder {out}: {error.strerror}") from error
    files = {
        out / REPORT: to_json(report).encode(),  # first: it marks the folder as one that may be replaced
        out / "curves.csv": csv_text(curve_rows(comparison)).encode(),
        out / "summary.csv": csv_text(summary_rows(comparison)).encode(),
        out / "improvement.csv": csv_text(
            improvement_rows(comparison),
            ("group", "other", "score", "probability", "probability_low", "probability_high"),
        ).encode(),
    }
    for path, content in files.items():
        write_atomically(path, content)
    return [*files, *draw_comparison(comparison, out)]


def _print(comparison: Comparison, notes: Sequence[str], written: Sequence[Path]) -> None:
    from hierroom.lab.compare.tables import MAX_PAIRS, improvement_table, summary_table

    console = Console()
    print_table(summary_table(comparison), console)
    if comparison.improvements:
        print_table(improvement_table(comparison), console)
        more = len(comparison.improvements) // 2 - MAX_PAIRS
        if more > 0:
            console.print(f"{more} more pairs are in improvement.csv")
    for note in notes:
        console.print(f"- {note}", markup=False, highlight=False, soft_wrap=True)
    console.print(f"written: {', '.join(map(str, written))}", markup=False, highlight=False, soft_wrap=True)
