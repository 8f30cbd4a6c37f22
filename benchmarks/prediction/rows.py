"""The runs that fit and test the prediction of training steps, next to what random play showed of their tasks.

They are those of the sweeps at home, and those of the arena, whose tasks are called family/task here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.prediction.play import PLAY, RESULTS, SWEEPS, config_of, read_rows
from hierroom.lab.advise.measures import Known

PPO_SWEEPS = {"conjecture": "PPO", "study_factors": "gamma 0.98", "predicted_trees": "PPO"}
"""The runs of PPO, by the variant of their row: in EscapeRooms only twelve graphs, with another discount."""
ARENA = RESULTS / "arena"
FIRST = 10_000
"""Steps before which no evaluation could see a milestone: a run that has it at step 0 got there before this one."""


@dataclass(frozen=True, eq=False)
class Runs:
    """R runs of one method to one milestone.

    Args:
        tasks: [R] the task of each.
        worlds: [R] the world of each.
        low: [R] log of the steps by which the milestone was not reached yet; ``-inf`` if there are none.
        high: [R] log of the steps by which it was; ``inf`` if it never was. Equal to ``low`` where they are known.
    """

    tasks: NDArray[Any]
    worlds: NDArray[Any]
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    @classmethod
    def of(cls, rows: Sequence[tuple[str, str, float, float]]) -> Runs:
        """Return runs from the task, world, ``low`` and ``high`` of each."""
        tasks, worlds, low, high = zip(*rows, strict=True) if rows else ((), (), (), ())
        return cls(np.array(tasks, str), np.array(worlds, str), np.array(low, float), np.array(high, float))

    def __len__(self) -> int:
        return len(self.tasks)

    def where(self, chosen: NDArray[np.bool_]) -> Runs:
        """Return some of the runs."""
        return Runs(self.tasks[chosen], self.worlds[chosen], self.low[chosen], self.high[chosen])

    def measured(self, known: dict[str, Known], measure: Callable[[Known], float]) -> NDArray[np.float64]:
        """Return the log of a measure [R] of each run's task; ``nan`` where it is not known."""
        values = {task: measure(known[task]) for task in set(self.tasks.tolist())}
        logs = {task: np.log(value) if np.isfinite(value) and value > 0 else np.nan for task, value in values.items()}
        return np.array([logs[task] for task in self.tasks.tolist()])


def known_tasks() -> tuple[dict[str, Known], dict[str, str]]:
    """Return what is known of each task before training, and what it is for: its world, or a test."""
    known = {row["task"]: known_of(row) for row in read_rows(PLAY)}
    uses = {row["task"]: row["use"] for row in read_rows(PLAY)}
    played = [row for row in read_rows(ARENA / "play.csv") if not row["error"]]
    return (
        known | {arena_task(row): known_of(row) for row in played},
        uses | {arena_task(row): row["family"] for row in played},
    )


def known_of(row: Mapping[str, str]) -> Known:
    """Return what a row of random play says of a task."""
    kinds: dict[str, Any] = Known.__annotations__
    return Known(**{name: (int if kind == "int" else float)(float(row[name] or "nan")) for name, kind in kinds.items()})


def arena_task(row: Mapping[str, str]) -> str:
    """Return the name of a task of the arena."""
    return f"{row['family']}/{row['task']}"


def arena_runs(rows: Sequence[Mapping[str, str]], method: str, milestone: str) -> Runs:
    """Return the runs of a method in the arena that did not fail."""
    return Runs.of(
        [
            (arena_task(row), row["family"], *times(row[milestone], float(row["steps"]), float(row["first"])))
            for row in rows
            if row["method"] == method and not row["error"]
        ]
    )


def read_runs(method: str, milestone: str, known: dict[str, Known], uses: dict[str, str]) -> Runs:
    """Return the runs of a method (with scripted goals, if it has goals) in all tasks in which play was measured."""
    found = []
    for sweep in SWEEPS if method != "ppo" else PPO_SWEEPS:
        twins = {row["graph"] for row in read_rows(RESULTS / sweep / "measures.csv") if row.get("twin_of")}
        for row in read_rows(RESULTS / sweep / "sweep.csv"):
            if row["method"] != method or row["meta"] not in ("fixed-dfs", "none") or row["graph"] in twins:
                continue
            if method == "ppo" and row["variant"] != PPO_SWEEPS[sweep]:
                continue
            if (task := config_of(row | {"sweep": sweep}).key) in known:
                found.append((task, uses[task], *times(row[milestone], float(row["steps"]))))
    every, arena = Runs.of(found), arena_runs(read_rows(ARENA / "runs.csv"), method, milestone)
    return Runs(*(np.concatenate(pair) for pair in zip(vars(every).values(), vars(arena).values(), strict=True)))


def times(text: str, steps: float, first: float = FIRST) -> tuple[float, float]:
    """Return the logs ``low`` and ``high`` of `Runs` for a milestone as a table has it, in a run of some steps.

    Args:
        text: the steps at which it was reached; "" if it never was, "0" if it was before anything could see it.
        steps: of the run.
        first: the first evaluation after the one at step 0.
    """
    if not text:
        return float(np.log(steps)), np.inf
    return (-np.inf, float(np.log(first))) if float(text) < 1 else (float(np.log(float(text))),) * 2


def task_medians(runs: Runs, values: Sequence[float] | NDArray[np.float64]) -> tuple[NDArray, NDArray, NDArray]:
    """Return each task, the median of its runs' values and of their steps (``inf``: never), both as logs."""
    times = np.where(np.isinf(runs.high), np.inf, np.where(np.isinf(runs.low), runs.high, runs.low))
    tasks = np.unique(runs.tasks)
    where = [runs.tasks == task for task in tasks]
    medians = [np.sort(times[one])[one.sum() // 2] for one in where]
    return tasks, np.array([np.median(np.asarray(values)[one]) for one in where]), np.array(medians)
