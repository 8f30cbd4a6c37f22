"""Measure what the hitting time adds to random play: rank correlations with training steps, each given the other.

    python -m benchmarks.prediction.hitting

The median run of a task counts; tasks that most runs did not learn share the last rank. Brackets of the partial
correlation are 95% intervals over resampled tasks. W x kinds was chosen after the runs; the tech trees were chosen so
that their hitting times and numbers of goals disagree.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from benchmarks.prediction.__main__ import WANTED, WORLDS, write_and_print
from benchmarks.prediction.play import RESULTS, SWEEPS, read_rows
from benchmarks.prediction.rows import known_tasks, read_runs, task_medians
from hierroom.lab.advise.measures import MEASURES
from hierroom.support.cli import run

RESAMPLES = 2000


def ranks(columns: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """Return the rank correlations of x and of z with y, and each given the other, from [n, 3] x, z and y."""
    (_, r_xz, r_xy), (_, _, r_zy), _ = np.corrcoef(rankdata(columns, axis=0).T)

    def given(one: float, other: float) -> float:
        return (one - other * r_xz) / np.sqrt((1 - other**2) * (1 - r_xz**2))

    return r_xy, r_zy, given(r_xy, r_zy), given(r_zy, r_xy)


def rows() -> Iterator[dict[str, str | int]]:
    """Yield a row for each method, milestone and world."""
    known, uses = known_tasks()
    tables = [row for sweep in SWEEPS for row in read_rows(RESULTS / sweep / "measures.csv")]
    hitting = {row["graph"]: float(row["hitting_time"]) for row in tables}
    for method, milestone in WANTED[:4]:
        runs = read_runs(method, milestone, known, uses)
        runs = runs.where(np.array([task.split()[0] in hitting for task in runs.tasks]))
        for world in WORLDS:
            part = runs.where(runs.worlds == world)
            tasks, cost, steps = task_medians(part, part.measured(known, MEASURES["W x kinds"]))
            last = steps[np.isfinite(steps)].max() + 1
            columns = np.stack([cost, [hitting[task.split()[0]] for task in tasks], np.minimum(steps, last)], axis=1)
            columns, random = columns[np.isfinite(cost)], np.random.default_rng(0)
            draws = [ranks(columns[random.integers(len(columns), size=len(columns))]) for _ in range(RESAMPLES)]
            low, high = np.quantile(np.array(draws)[:, 3], (0.025, 0.975))
            names = ("W x kinds", "hitting time", "W x kinds given hitting time", "hitting time given W x kinds")
            numbers = {name: f"{value:.2f}" for name, value in zip(names, ranks(columns), strict=True)}
            facts = {"method": method, "milestone": milestone, "world": world, "tasks": len(columns)}
            yield facts | numbers | {"low": f"{low:.2f}", "high": f"{high:.2f}"}


def main() -> int:
    """Run the command."""
    write_and_print([*rows()], "hitting_time.csv")
    return 0


if __name__ == "__main__":
    run(main)
