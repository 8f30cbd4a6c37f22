"""How often the study's intervals hold the truth, on made-up tables whose truth is known.

    python -m benchmarks.study.interval_coverage

Each table has 79 graphs of ten seeds: a measure that is standard normal, a difficulty that Pearson's correlation r ties
to it, and normal noise of the seeds. The truth is Spearman's correlation over two hundred thousand graphs.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from benchmarks.result_table import ResultTable
from benchmarks.study.correlations import interval, rank_correlations, resampled
from benchmarks.study.trained import medians

N_GRAPHS, N_SEEDS, N_POPULATION = 79, 10, 200_000
CASES = ((0.95, 0.1), (0.85, 0.3), (0.85, 1.0), (0.5, 0.3))
"""r, and the deviation of the seeds' noise, that of the graphs' difficulty being 1."""


@dataclass(frozen=True)
class Options:
    """Count how often the truth is inside.

    Args:
        tables: for each case.
        resamples: of each table.
        level: confidence level.
        seed: of everything.
        out: a file that the table is written to as CSV.
    """

    tables: int = 200
    resamples: int = 200
    level: float = 0.95
    seed: int = 0
    out: Path | None = None


def draw(r: float, noise: float, n_graphs: int, rng: np.random.Generator) -> tuple[NDArray, NDArray]:
    measure = rng.normal(size=n_graphs)
    difficulty = r * measure + np.sqrt(1 - r**2) * rng.normal(size=n_graphs)
    return measure, difficulty[:, None] + noise * rng.normal(size=(n_graphs, N_SEEDS))


def rho(measure: NDArray, outcomes: NDArray) -> float:
    return float(rank_correlations(np.column_stack([measure, medians(outcomes)]))[0, 1])


def main(options: Options) -> None:
    rng, console = np.random.default_rng(options.seed), Console(stderr=True)
    rows = []
    for r, noise in CASES:
        truth, held, widths = rho(*draw(r, noise, N_POPULATION, rng)), 0, []
        for _ in track(range(options.tables), f"r {r}, noise {noise}", console=console, transient=True):
            measure, outcomes = draw(r, noise, N_GRAPHS, rng)
            resamples = []
            for _ in range(options.resamples):
                graphs = rng.integers(N_GRAPHS, size=N_GRAPHS)
                resamples.append(rho(measure[graphs], resampled(outcomes[graphs], rng)))
            _, low, high = interval(rho(measure, outcomes), resamples, options.level)
            held += low <= truth <= high
            widths.append(high - low)
        rows.append((f"{r}", f"{noise}", f"{truth:.3f}", f"{held / options.tables:.1%}", f"{np.mean(widths):.3f}"))
    ResultTable(("r", "noise", "truth", "covered", "mean width"), tuple(rows)).publish(options.out)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
