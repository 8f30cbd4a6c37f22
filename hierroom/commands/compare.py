"""Compare training runs: ``python -m hierroom compare RUNS --by meta``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from hierroom.lab.compare.curve import metric_of
from hierroom.support.cli import Flag, progress_bar, read_arguments
from hierroom.support.errors import InputError, one_line, require_number
from hierroom.support.files import to_json, usable_path, write_atomically
from hierroom.support.tables import csv_text, print_table

if TYPE_CHECKING:
    from hierroom.lab.compare.comparison import Comparison

REPORT = "comparison.json"  # marks the folder of an earlier comparison


@dataclass(frozen=True)
class CompareArguments:
    """Compare training runs by their evaluations: learning curves with bands, area under the curve, improvement.

    Writes curves.csv, summary.csv, improvement.csv, comparison.json, curves.pdf and curves.png.

    Args:
        runs: folders of runs, or folders that contain them.
        by: entries of the config to group runs by, named as in training and joined by commas: meta, or method,gamma;
            or variant, the name that a sweep's plan gave. By default those that differ between the runs, variant and
            method first; not seed, graph, steps, threads, device or evaluations.
        outcome: what to compare, over the steps trained: success_rate, score (over all goals, without a target),
            return, length, length_over_shortest, or the name of a goal for its share of episodes; by default the first
            of success_rate, score and return that is known.
        out: the folder to write to: new, empty, or of an earlier comparison, which is replaced; by default a new one,
            compare, compare-2, ...
        resamples: resamples of the bootstrap.
        seed: determines the resamples.
        json: print comparison.json instead of tables.
    """

    runs: Annotated[
        tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUNS", help_behavior_hint="(required)")
    ]
    by: str | None = None
    outcome: str | None = None
    out: Path | None = None
    resamples: int = 2000
    seed: int = 0
    json: Flag = False


def main(argv: Sequence[str]) -> int:
    """Run the command with its arguments."""
    arguments = read_arguments(CompareArguments, "compare", argv)
    if not arguments.runs:
        raise InputError("give the folders of the runs to compare, or a folder that contains them")
    require_number("resamples", arguments.resamples, 100, 10**6, is_whole=True)
    require_number("seed", arguments.seed, 0, 2**63 - 1, is_whole=True)
    out = arguments.out
    if out is not None and usable_path(out).exists():
        is_empty = out.is_dir() and not any(out.iterdir())
        if not is_empty and not (out / REPORT).is_file():
            other = f"{out} is neither an empty folder nor that of an earlier comparison"
            raise InputError(f"{other}; choose another --out")
    comparison, notes = _compared(arguments)
    report = _report(comparison, notes, arguments)
    if out is None:
        from hierroom.runs.folder.run_folder import claim_folder  # imports torch

        out = claim_folder(Path("compare"))
    written = _write(comparison, report, out)
    if arguments.json:
        print(to_json(report))
    else:
        _print(comparison, notes, written)
    return 0


def _compared(arguments: CompareArguments) -> tuple[Comparison, list[str]]:
    # These import torch, scipy and matplotlib, and --help does not need them.
    from hierroom.lab.compare.caveats import caveats
    from hierroom.lab.compare.comparison import compare
    from hierroom.lab.compare.evaluated_run import (
        find_runs,
        known_metrics,
        metric_named,
        read_each,
        read_run,
        refuse_without_overlap,
    )
    from hierroom.lab.compare.grouping import choose_groups
    from hierroom.lab.compare.tasks import Tasks

    with progress_bar() as bar:
        paths, left_out = find_runs(arguments.runs)
        if not paths:
            raise InputError(f"no run in {', '.join(map(str, arguments.runs))} has evaluations")
        runs, unread = read_each(bar.track(paths, description="reading"), read_run)
        refuse_without_overlap(runs)
        groups = choose_groups(runs, arguments.by)
        tasks = Tasks.common(groups)
        track = partial(bar.track, description="estimating")
        outcome = known_metrics(runs)[0] if arguments.outcome is None else metric_named(arguments.outcome, runs)
        comparison = compare(groups, tasks, outcome, arguments.resamples, arguments.seed, track)
    notes = [*unread, *(f"left out, as it has no evaluations: {path}" for path in left_out)]
    if arguments.by is None:
        notes.append(f"compared by {', '.join(comparison.by)}, as no --by was given")
    return comparison, notes + caveats(comparison)


def _report(comparison: Comparison, notes: Sequence[str], arguments: CompareArguments) -> dict[str, Any]:
    from hierroom.lab.compare.tables import improvement_rows, summary_rows

    return {
        "by": list(comparison.by),
        "metric": comparison.metric,
        "is_higher_better": metric_of(comparison.metric).is_higher_better,
        "graphs": [*map(str, comparison.tasks.graphs)],
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
    from hierroom.lab.compare.tables import curve_rows

    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot create the folder {out}: {error.strerror}") from error
    columns = ("group", "other", "score", "probability", "probability_low", "probability_high")
    files = {
        out / REPORT: to_json(report),  # first: it marks the folder as one that may be replaced
        out / "curves.csv": csv_text(curve_rows(comparison)),
        out / "summary.csv": csv_text(report["summary"]),
        out / "improvement.csv": csv_text(report["improvement"], columns),
    }
    for path, text in files.items():
        write_atomically(path, text)
    return [*files, *draw_comparison(comparison, out)]


def _print(comparison: Comparison, notes: Sequence[str], written: Sequence[Path]) -> None:
    from hierroom.lab.compare.tables import MAX_PAIRS, improvement_table, summary_table

    print_table(summary_table(comparison))
    if comparison.improvements:
        print_table(improvement_table(comparison))
        if (more := len(comparison.improvements) - MAX_PAIRS) > 0:
            print(f"{more} more pairs are in improvement.csv")
    for note in notes:
        print(one_line(f"- {note}"))
    print(f"written: {', '.join(map(str, written))}")
