"""The runs for the paper's Table 3 and figures: four methods on graphs a to g, with the preset paper."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import t

from benchmarks.paper.published import METHODS
from hierroom.lab.sweep.plan import Plan
from hierroom.lab.sweep.sweep import Sweep
from hierroom.support.cli import shell_words
from hierroom.support.errors import InputError, RunError, require_number

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class PaperRuns:
    """Train the runs of the paper's Table 3 and figures; runs that exist are used.

    Args:
        out: the folder of the sweep and of the figures.
        seeds: seeds 0, 1, ... of each method and graph; the paper has 5.
        steps: primitive steps of each run; the paper has 10 million.
        sizes: grid sizes; the paper does not give its own.
        graphs: goal graphs, a to g.
        evaluations: how often each run is evaluated for the learning curves.
        evaluation_episodes: episodes of each of these evaluations.
        episodes: episodes of the evaluation at the end of each run.
        processes: number of runs at a time; by default one for each core.
        ray: address of a Ray cluster that trains the runs.
    """

    out: Path = Path("paper")
    seeds: int = 3
    steps: int = 10_000_000
    sizes: tuple[int, ...] = (19,)
    graphs: tuple[str, ...] = ("a", "b", "c", "d", "e", "f", "g")
    evaluations: int = 30
    evaluation_episodes: int = 100
    episodes: int = 1000
    processes: int | None = None
    ray: str | None = None

    def __post_init__(self) -> None:
        require_number("evaluations", self.evaluations, 1, is_whole=True)
        if not self.sizes:
            raise InputError("sizes needs at least one grid size, such as --sizes 19")

    def sweep(self, graphs: Iterable[str], methods: Iterable[str]) -> Sweep:
        """Return the sweep of some of the graphs and methods."""
        values = {
            "preset": ["paper"],
            "method": [*methods],
            "steps": [self.steps],
            "size": [*self.sizes],
            "evaluations": [self.evaluations],
            "evaluation_episodes": [self.evaluation_episodes],
        }
        return Sweep(Plan(values, tuple(graphs), self.seeds, episodes=self.episodes), self.out)

    @property
    def command(self) -> str:
        """A command that makes these runs, without options that do not change results; so it depends on no machine."""
        words = ["python", "-m", "benchmarks.paper", "all"]
        for entry in fields(self):
            value = getattr(self, entry.name)
            if entry.name not in ("out", "processes", "ray") and value != entry.default:
                several = value if isinstance(value, tuple) else (value,)
                words += [f"--{entry.name.replace('_', '-')}", *map(str, several)]
        return shell_words(*words)

    def train(self, graphs: Iterable[str], methods: Iterable[str] = METHODS) -> Sweep:
        """Train the missing runs of some graphs and methods; an interruption keeps the finished ones."""
        chosen = [graph for graph in graphs if graph in self.graphs]
        if not chosen or not {*self.graphs} <= {*"abcdefg"}:
            needed, given = ", ".join(graphs), " ".join(self.graphs)
            raise InputError(f"this needs one of the paper's graphs {needed}, not {given!r}")
        sweep = self.sweep(chosen, methods)
        outcome = sweep.fill(processes=self.processes, ray=self.ray, command=self.command)
        if outcome.is_interrupted:
            raise KeyboardInterrupt
        if outcome.failures:
            run, reason = outcome.failures[0]
            n, planned = len(outcome.failures), len(sweep.plan.runs())
            raise RunError(f"{n} of {planned} runs failed, {run.name} among them: {reason}")
        return sweep


def cell(rows: pd.DataFrame, method: str, graph: str, size: int) -> pd.DataFrame:
    """Return the rows of one method on one graph and size, one for each seed."""
    return rows[(rows["method"] == method) & (rows["graph"] == graph) & (rows["size"] == str(size))]


def mean_and_interval(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean over seeds [S, ...] and its 95% interval's half-width (Student's t), NaN for a single seed."""
    if (n := len(values)) < 2:
        return values.mean(axis=0), np.full(values.shape[1:], np.nan)
    return values.mean(axis=0), t.ppf(0.975, n - 1) * values.std(axis=0, ddof=1) / np.sqrt(n)
