"""Judge the predictions of the tasks that nobody had trained on, by the runs that were made afterwards.

    python -m benchmarks.prediction.judge

A row for each method, milestone and world, of the runs that there are; tasks without a prediction are only counted. A
prediction of no number is wrong by an infinite factor where the run got there. Column ``one_seed`` is what the
seeds alone leave, from other tasks with several of them: no prediction of single runs can be much better.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from benchmarks.prediction.__main__ import FOLDER, WANTED, rounded, write_and_print
from benchmarks.prediction.fit import score
from benchmarks.prediction.play import RESULTS, config_of, read_rows
from benchmarks.prediction.rows import Runs, known_tasks, read_runs, times
from hierroom.support.cli import run


@dataclass(frozen=True)
class Options:
    """Judge the predictions of benchmarks/results/prediction/new.csv.

    Args:
        trees: the runs in tech trees.
        rooms: the runs in EscapeRooms.
    """

    trees: Path = RESULTS / "predicted_trees" / "sweep.csv"
    rooms: Path = RESULTS / "predicted_rooms" / "sweep.csv"


def judged(options: Options) -> Iterator[dict[str, Any]]:
    """Yield a row for each method, milestone and world."""
    new = {row["task"]: row for row in read_rows(FOLDER / "new.csv")}
    worlds = {"workshop": read_rows(options.trees), "escape_room": read_rows(options.rooms)}
    known, uses = known_tasks()
    for method, milestone in WANTED:
        fitted = read_runs(method, milestone, known, uses)
        of_method = {world: [row for row in rows if row["method"] == method] for world, rows in worlds.items()}
        for world, rows in {"both": [*of_method["workshop"], *of_method["escape_room"]], **of_method}.items():
            names = [f"{method} {milestone}{end}" for end in ("", "_low", "_high")]
            found = [(key, row, new[key]) for row in rows if (key := config_of(row).key) in new]
            found = [(key, row, [float(one[name]) for name in names]) for key, row, one in found if one[names[0]]]
            if not found:
                continue
            ends = [times(row[milestone], float(row["steps"])) for _, row, _ in found]
            runs = Runs(np.array([key for key, *_ in found]), np.full(len(found), world), *np.array(ends).T)
            middle, low, high = np.log([steps for *_, steps in found]).T
            facts = {"method": method, "milestone": milestone, "world": world, "runs": len(rows)}
            least = one_seed_factor(fitted.where(fitted.worlds == world))
            yield facts | rounded(score(runs, middle, low, high)) | {"one_seed": f"{least:.3g}"}


def one_seed_factor(runs: Runs) -> float:
    """Return the median factor between a run and the median of its task's other seeds; ``nan`` without others."""
    found = []
    for task in np.unique(runs.tasks):
        steps = runs.high[runs.tasks == task]
        medians = [np.median(np.delete(steps, n)) for n in range(len(steps))] if len(steps) > 1 else []
        pairs = [(one, middle) for one, middle in zip(steps, medians, strict=False) if np.isfinite([one, middle]).all()]
        found += [abs(one - middle) for one, middle in pairs]
    return float(np.exp(np.median(found))) if found else np.nan


def main() -> int:
    """Run the command."""
    write_and_print([*judged(tyro.cli(Options, description=__doc__))], "judged.csv")
    return 0


if __name__ == "__main__":
    run(main)
