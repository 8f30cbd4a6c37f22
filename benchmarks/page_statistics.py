"""Compute anew the correlations that README and docs show, from the rows in `benchmarks/results/`.

    python -m benchmarks.page_statistics

Of each `measures` table of the pages (see `benchmarks.tables`) the correlations are written next to the rows
of its sweep, of as many seeds as are whole. It takes about a minute for each; `benchmarks.tables` puts the tables into
the pages.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro

from benchmarks.committed import ROOT, plan_of
from benchmarks.study.page_tables import correlations_file, milestone_and_words
from benchmarks.study.result import csv_text
from benchmarks.study.statistics import Options as StudyOptions
from benchmarks.study.statistics import study
from benchmarks.study.tables import measures_for, read_rows
from benchmarks.study.trained import Milestone
from benchmarks.tables import PAGES, named_tables
from hierroom.lab.sweep.table import SweepTable
from hierroom.support.cli import run
from hierroom.support.files import write_atomically


@dataclass(frozen=True)
class Options:
    """Compute the correlations of the pages anew."""


def shown_correlations() -> list[tuple[str, Milestone | None]]:
    """Return the sweeps whose correlations pages show, each with its milestone, or None for that of the rules."""
    named = [one for page in PAGES for one in named_tables(page.read_text(encoding="utf-8"))]
    words = [words for kind, words in named if kind == "measures"]
    return list(dict.fromkeys((name, milestone_and_words(others)[0]) for name, *others in words))


def n_whole_seeds(name: str) -> int:
    """Return how many of a sweep's first seeds are whole."""
    runs = plan_of(name).runs()
    done = {*SweepTable(ROOT / "benchmarks" / "results" / name).of(runs)["digest"]}
    unfinished = [run.config.seed for run in runs if run.digest not in done]
    return min(unfinished, default=1 + max(run.config.seed for run in runs))


def write_correlations(name: str, milestone: Milestone | None) -> Path:
    """Compute the correlations of a sweep's whole seeds; returns the path of their table, from the repository's root.

    Args:
        name: of the sweep.
        milestone: the milestone that ranks runs by its steps; None: that of the study's rules.

    Raises:
        InputError: if no seed is whole, or as `benchmarks.study.statistics.study`.
    """
    folder = Path("benchmarks", "results", name)
    path = folder / correlations_file(milestone)
    options = StudyOptions(folder / "sweep.csv", outcome=milestone, seeds=n_whole_seeds(name))
    results = study(read_rows(ROOT / options.table), measures_for(ROOT / options.table), options)
    write_atomically(ROOT / path, csv_text(results).encode())
    return path


def main() -> int:
    """Run the command."""
    tyro.cli(Options, description=__doc__)
    for name, milestone in shown_correlations():
        print(f"written: {write_correlations(name, milestone)}")
    return 0


if __name__ == "__main__":
    run(main)
