"""Folders of runs that were never trained, with curves of known shape, and the rows of tables."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder

STEPS = (0, *(round(s) for s in np.geomspace(0.01, 1, 20) * 1_000_000))


def make_run(
    path: Path,
    curves: Mapping[str, Callable[[float], float]],
    steps: Sequence[int] = STEPS,
    episodes: int = 200,
    **entries: Any,
) -> Path:
    """Write a run with success rates that are functions of the steps; a failed episode takes 1000 steps."""
    graph = {} if len(curves) > 1 or "graph" in entries else {"graph": next(iter(curves))}
    folder = RunFolder.create(path, TrainConfig().changed(**{**graph, **entries}))
    rows = []
    for at in steps:
        for name, curve in curves.items():
            success = curve(at)
            row = {"steps": at, "seconds": at / 5000, "graph": name, "episodes": episodes, "success_rate": success}
            row |= {"success_low": max(success - 0.05, 0), "success_high": min(success + 0.05, 1)}
            row |= {"length": 1000 - 950 * success, "return": 2 * success}
            rows.append(row | {"length_over_shortest": 3 - 1.9 * success if success else float("nan")})
    folder.evaluations.append(rows)
    return path


def line(end: float, start: float = 0.0) -> Callable[[float], float]:
    return lambda steps: start + (end - start) * steps / 1_000_000


def rise(middle: float, top: float = 1.0) -> Callable[[float], float]:
    return lambda steps: top * steps**3 / (steps**3 + middle**3)


def rows(path: str | Path) -> list[dict[str, str]]:
    with Path(path).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def row(path: str | Path, **wanted: object) -> dict[str, str]:
    """Return the only row of a table with these values."""
    (found,) = [one for one in rows(path) if all(one[name] == str(value) for name, value in wanted.items())]
    return found
