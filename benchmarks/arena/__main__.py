"""The arena: predict how long training takes in worlds that others wrote, train, and judge the predictions.

    python -m benchmarks.arena predict --families toy_text   # the rows that are lacking; commit them before the next
    python -m benchmarks.arena run --families toy_text       # the runs that are lacking, one after the other
    python -m benchmarks.arena judge                         # the verdict by the rules of docs/arena.md
    python -m benchmarks.arena predict --families            # which families there are, and what installs the others

Without ``--families`` all installed ones are taken, in the order that was drawn.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.arena.families import FAMILIES, find_families
from benchmarks.arena.predictions import METHODS, predict_rows
from benchmarks.arena.runs import ARMS, plan, run_rows
from benchmarks.arena.verdict import judge
from benchmarks.prediction.play import RESULTS
from hierroom.support.cli import run
from hierroom.support.errors import InputError

FOLDER = RESULTS / "arena"


def list_families() -> None:
    """Print which families there are, and how to install the others."""
    for family in FAMILIES.values():
        words = (
            f"{len(family.tasks())} tasks" if family.is_installed else f"not installed:  pip install {family.install}"
        )
        print(f"{family.name:<24} {family.steps:>9,} steps  {words}")


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=("predict", "run", "judge"))
    parser.add_argument("--families", nargs="*", metavar="FAMILY", help="which ones; without a name, list them")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="of play.csv, predictions.csv and runs.csv")
    parser.add_argument("--processes", type=int, default=1, help="runs at a time")
    parser.add_argument("--arms", action="store_true", help="train also what shows which part of HiPPO makes its lead")
    given = parser.parse_args()
    if given.families == []:
        list_families()
        return 0
    families = find_families(given.families or [])
    given.folder.mkdir(parents=True, exist_ok=True)
    if given.command == "predict":
        predict_rows(families, given.folder)
    elif given.command == "run":
        if given.arms and (ours := [family.name for family in families if family.is_ours]):
            raise InputError(f"arms are for families by others; not for {', '.join(ours)}: see docs/arena.md")
        methods = [*METHODS, *ARMS] if given.arms else METHODS
        runs = [one for family in families for one in plan(family.name, [*family.tasks()], methods)]
        run_rows(runs, given.folder, given.processes)
    else:
        print(judge(given.folder, given.families or [*FAMILIES]))
    return 0


if __name__ == "__main__":
    run(main)
