"""The verdict of the arena, by the rules of docs/arena.md."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student_t

from benchmarks.arena.lead import LEAD, PROPERTIES, Row, lead_cells, property_cells
from benchmarks.arena.predictions import METHODS, MILESTONES
from benchmarks.arena.runs import whole_families
from benchmarks.prediction.candidates import CANDIDATES
from benchmarks.prediction.fit import concordance, score
from benchmarks.prediction.play import read_rows
from benchmarks.prediction.rows import Runs, arena_runs, arena_task, known_of
from hierroom.support.tables import markdown_table

ALL, HORIZON = "all", "effective horizon"
_COLUMNS = ("tasks", "runs", "reached", "rank", "C", "factor", "within 2", "inside", "outside", "undecided", "coverage")
_POOLED = ("rank", "C", "factor", "within 2", "coverage")
MIN_FAMILIES = 3
"""A mean of fewer families has no interval worth printing."""


def judge(folder: Path, families: Sequence[str]) -> str:
    """Return the tables of what was predicted, what measures tell, where hierarchy pays, and what failed."""

    def read(name: str) -> list[dict[str, str]]:
        return [row for row in read_rows(folder / name) if row["family"] in families]

    predicted = {arena_task(row): row for row in read("predictions.csv")}
    play = {arena_task(row): row for row in read("play.csv") if not row["error"]}
    rows = read("runs.csv")
    good = [row for row in rows if arena_task(row) in predicted]
    values = {task: {name: measure(row) for name, measure in _measures().items()} for task, row in play.items()}
    horizons = {arena_task(row): float(row["log_samples"]) for row in read("horizon.csv") if not row["error"]}
    with_horizon = {task: values[task] | {HORIZON: one} for task, one in horizons.items() if task in values}
    names = ["family", "method", "milestone"]
    verdict = [*_predicted(predicted, good, families)]
    finished = whole_families(folder)
    whole = [cells for cells in verdict if cells[0] in finished]
    tables = (
        ([*names, *_COLUMNS], verdict),
        (["method", "milestone", "families", *_POOLED], pooled_cells(whole)),
        ([*names, "runs", *_measures()], _measured(values, good, families)),
        ([*names, "runs", *_measures(), HORIZON], _measured(with_horizon, good, families)),
        (["family", "tasks", "not predicted", "why"], _outside(predicted, families)),
        (["family", "steps of", "milestone", *LEAD], lead_cells(good, families)),
        (["family", "tasks", *PROPERTIES], property_cells(good, play, families)),
    )
    parts = [markdown_table(headings, cells) for headings, rows_of in tables if (cells := [*rows_of])]
    failed = [
        f"failed: {arena_task(row)} {row['method']} {row['seed']}: {row['error']}" for row in rows if row["error"]
    ]
    return "\n\n".join([*parts, *failed])


def verdicts(runs: Runs, low: NDArray[np.float64], high: NDArray[np.float64]) -> tuple[int, int, int]:
    """Return how many runs are inside of their 90% intervals, outside, and undecided; the ends are logs of steps.

    A run that ended without the milestone is outside if the interval ended before, inside if the interval has no end,
    and undecided otherwise. One that had it before anything could see it is inside if the interval begins before that.
    """
    late, early = np.isinf(runs.high), np.isinf(runs.low)
    steps = np.where(early, runs.high, runs.low)
    outside = np.where(late, high < steps, (steps < low) | (~early & (steps > high)))
    undecided = late & ~outside & np.isfinite(high)
    n = len(runs) - int(outside.sum()) - int(undecided.sum())
    return n, int(outside.sum()), int(undecided.sum())


def _groups(
    rows: Sequence[Row], families: Sequence[str], is_known: Callable[[str, str, str], bool]
) -> Iterator[tuple[list[str], Runs]]:
    for family in (*families, ALL):
        for method in METHODS:
            for milestone in MILESTONES:
                runs = arena_runs([row for row in rows if family in (row["family"], ALL)], method, milestone)
                runs = runs.where(np.array([is_known(task, method, milestone) for task in runs.tasks], bool))
                if len(runs):
                    yield [family, method, milestone], runs


def _predicted(predicted: Mapping[str, Row], rows: Sequence[Row], families: Sequence[str]) -> Iterator[list[str]]:
    def is_known(task: str, method: str, milestone: str) -> bool:
        return bool(predicted[task].get(f"{method} {milestone}"))

    for names, runs in _groups(rows, families, is_known):
        _, method, milestone = names
        middle, low, high = (
            np.log([float(predicted[task][f"{method} {milestone}{end}"]) for task in runs.tasks])
            for end in ("", "_low", "_high")
        )
        scored = score(runs, middle, low, high)
        inside, outside, undecided = verdicts(runs, low, high)
        share = inside / (inside + outside) if inside + outside else np.nan
        counts = [scored.tasks, len(runs), int(np.isfinite(runs.high).sum())]
        numbers = [scored.rank, scored.concordance, scored.factor, scored.within_2]
        ends = [*map(str, (inside, outside, undecided)), _short(share)]
        yield [*names, *map(str, counts), *map(_short, numbers), *ends]


def pooled_cells(verdict: Sequence[Sequence[str]]) -> Iterator[list[str]]:
    """Yield the mean of the families' figures, each family being one draw, with 90% intervals by Student's t.

    Means of factors are geometric. `judge` gives it the families that have all their runs.
    """
    names = ("family", "method", "milestone", *_COLUMNS)
    tables = [dict(zip(names, cells, strict=True)) for cells in verdict]
    for method, milestone in dict.fromkeys((one["method"], one["milestone"]) for one in tables):
        own = [one for one in tables if (one["method"], one["milestone"]) == (method, milestone)]
        if len(own) >= MIN_FAMILIES:
            figures = {name: [float(one[name]) for one in own if one[name] != "-"] for name in _POOLED}
            yield [method, milestone, str(len(own)), *(_mean(one, name == "factor") for name, one in figures.items())]


def _mean(figures: Sequence[float], is_factor: bool) -> str:
    if len(figures) < MIN_FAMILIES:
        return "-"
    if np.isinf(figures).any():  # a factor, of predictions that called most tasks out of reach and were wrong
        return "inf"
    values = np.log(figures) if is_factor else np.array(figures)
    half = student_t.ppf(0.95, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values))
    middle, low, high = (np.exp(one) if is_factor else one for one in values.mean() + half * np.array([0, -1, 1]))
    return f"{middle:.2f} [{low:.2f}, {high:.2f}]"


def _measures() -> dict[str, Callable[[Row], float]]:
    named = {name: lambda row, measure=measure: measure(known_of(row)) for name, measure in CANDIDATES.items()}
    return named | {name: lambda row, name=name: float(row[name]) for name in ("hitting_time", "goals")}


def _measured(
    values: Mapping[str, Mapping[str, float]], rows: Sequence[Row], families: Sequence[str]
) -> Iterator[list[str]]:
    """Yield Harrell's C of each measure, in the tasks in which all of them are known."""
    known = {task for task, every in values.items() if np.isfinite([*every.values()]).all()}
    for names, runs in _groups(rows, families, lambda task, *_: task in known):
        by_measure = zip(*(values[task].values() for task in runs.tasks), strict=True)
        yield [*names, str(len(runs)), *(_short(concordance(runs, np.array(one))) for one in by_measure)]


def _outside(predicted: Mapping[str, Row], families: Sequence[str]) -> Iterator[list[str]]:
    for family in families:
        own = [row for row in predicted.values() if row["family"] == family]
        reasons = [row["outside"] for row in own if row["outside"]]
        if own:
            why = "; ".join(f"{reasons.count(one)} x {one}" for one in dict.fromkeys(reasons))
            yield [family, str(len(own)), str(len(reasons)), why]


def _short(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.2f}"
