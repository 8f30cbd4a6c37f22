"""Share of 95% intervals of few runs that hold the true value, by simulation: the table in docs/compare.md.

    python -m benchmarks.interval_coverage

Scores are drawn from a distribution with known mean and interquartile mean. Intervals are from 500 resamples, which is
faster than the 2000 of ``compare``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track

from benchmarks.result_table import ResultTable
from hierroom.lab.compare.estimates import estimate, interquartile_mean, mean

EXPERIMENTS, RESAMPLES = 1000, 500
DISTRIBUTIONS = {
    "normal": lambda generator, n: generator.normal(size=n),
    "skewed": lambda generator, n: generator.beta(8, 2, size=n),
}
CASES = [(n_runs, n_graphs) for n_graphs, numbers in ((1, (3, 5, 10, 20)), (7, (3, 5, 10))) for n_runs in numbers]


@dataclass(frozen=True)
class Options:
    """Count how often the truth is inside.

    Args:
        out: a file that the table is written to as CSV.
    """

    out: Path | None = None


def coverage(statistic, draw, n_runs: int, n_graphs: int) -> float:
    """Return the fraction of experiments with the value of very many runs inside their interval."""
    generator = np.random.default_rng(0)
    truth = statistic([draw(generator, 1_000_000)[:, None, None]])[0]
    covered = 0
    for seed in range(EXPERIMENTS):
        strata = [draw(generator, n_runs)[:, None, None] for _ in range(n_graphs)]
        found = estimate(strata, statistic, RESAMPLES, seed)
        covered += found.lows[0] <= truth <= found.highs[0]
    return covered / EXPERIMENTS


def main(options: Options) -> None:
    columns = [(statistic, name) for statistic in (interquartile_mean, mean) for name in DISTRIBUTIONS]
    headings = (f"{statistic.__name__.replace('_', ' ')}, {name}" for statistic, name in columns)
    rows = []
    for n_runs, n_graphs in track(CASES, "cases", console=Console(stderr=True), transient=True):
        cells = (f"{coverage(statistic, DISTRIBUTIONS[name], n_runs, n_graphs):.2f}" for statistic, name in columns)
        rows.append((f"{n_runs}", f"{n_graphs}", *cells))
    ResultTable(("runs on each graph", "graphs", *headings), tuple(rows)).publish(options.out)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
