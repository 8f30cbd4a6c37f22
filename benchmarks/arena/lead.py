"""Where hierarchy pays in the arena: other methods' steps over HiPPO's, and what goes with that ratio."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import numpy as np
from scipy.stats import spearmanr

from benchmarks.arena.predictions import MILESTONES
from benchmarks.prediction.rows import arena_runs, task_medians

PROPERTIES = ("expected_steps", "random_success", "goals", "kinds", "fewest", "markings", "limit", "actions")
"""Of a task, known before training: columns of play.csv."""
LEAD = ("tasks", "neither", "HiPPO first", "ratio, lower quartile", "median", "upper quartile")
MIN_TASKS = 4
"""Ranks of fewer tasks say nothing."""

Row = Mapping[str, str]


def ratios(rows: Sequence[Row], method: str, milestone: str = "steps_to_50") -> dict[str, float]:
    """Return for each task a method's median steps to a milestone over HiPPO's.

    It is ``inf`` if only HiPPO's median run gets there, 0 if only the other's does, and ``nan`` if neither does.
    """
    own, hippo = (_medians(rows, name, milestone) for name in (method, "hippo"))
    return {task: _ratio(own[task], hippo[task]) for task in own if task in hippo}


def _medians(rows: Sequence[Row], method: str, milestone: str) -> dict[str, float]:
    runs = arena_runs(rows, method, milestone)
    tasks, _, times = task_medians(runs, np.zeros(len(runs)))
    return dict(zip(tasks.tolist(), np.exp(times).tolist(), strict=True))


def _ratio(own: float, hippo: float) -> float:
    return float("nan") if np.isinf(own) and np.isinf(hippo) else own / hippo


def lead_cells(rows: Sequence[Row], families: Sequence[str]) -> Iterator[list[str]]:
    """Yield for each family, method and milestone: tasks with a ratio, where HiPPO is first, the ratio's quartiles."""
    for family in families:
        own = [row for row in rows if row["family"] == family]
        methods = dict.fromkeys(row["method"] for row in own if row["method"] != "hippo")
        for method, milestone in product(methods, MILESTONES):
            found = np.array([*ratios(own, method, milestone).values()])
            known = found[~np.isnan(found)]
            if len(known):
                quartiles = np.quantile(known, [0.25, 0.5, 0.75], method="nearest")
                counts = len(known), len(found) - len(known), (known > 1).sum()
                yield [family, method, milestone, *map(str, counts), *(f"{one:.2f}" for one in quartiles)]


def property_cells(rows: Sequence[Row], play: Mapping[str, Row], families: Sequence[str]) -> Iterator[list[str]]:
    """Yield for each family the rank correlation of PPO+Bonus's ratio, to 50%, with each property of a task."""
    for family in families:
        found = ratios([row for row in rows if row["family"] == family], "ppo-bonus")
        tasks = [task for task, ratio in found.items() if not np.isnan(ratio) and task in play]
        if len(tasks) < MIN_TASKS:
            continue
        cells = []
        for name in PROPERTIES:
            texts = {task: play[task][name] for task in tasks}
            pairs = [(float(text), found[task]) for task, text in texts.items() if text]  # empty: play did not show it
            is_constant = any(len({*one}) == 1 for one in zip(*pairs, strict=True))
            is_known = len(pairs) >= MIN_TASKS and not is_constant
            cells.append(f"{_rank_correlation(*zip(*pairs, strict=True)):.2f}" if is_known else "-")
        yield [family, str(len(tasks)), *cells]


def _rank_correlation(values: Sequence[float], others: Sequence[float]) -> float:
    return float(spearmanr(values, others).statistic)  # pyright: ignore[reportArgumentType] - the stub has a tuple only
