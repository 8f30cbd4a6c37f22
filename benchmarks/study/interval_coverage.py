"""Count how often the study's intervals hold the truth, on made-up tables with a known truth.

    python -m benchmarks.study.interval_coverage

Each table has 79 graphs: two measures and a difficulty that are standard normal. Pearson's correlation r ties each
measure to the difficulty, and the seeds have normal noise. A share of the runs, those that would take longest, never
arrives. The truth is Spearman's correlation over two hundred thousand graphs, and 0 for the difference of the two
measures.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from scipy.stats import norm

from benchmarks.result_table import ResultTable
from benchmarks.study.correlations import interval, rank_correlations, resampled
from benchmarks.study.trained import medians

N_GRAPHS, N_POPULATION = 79, 200_000


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

    tables: int = 600
    resamples: int = 200
    level: float = 0.95
    seed: int = 0
    out: Path | None = None


@dataclass(frozen=True)
class Population:
    """The distribution that tables are drawn from.

    Args:
        r: Pearson's correlation of each measure with the difficulty.
        noise: the deviation of the seeds' noise, that of the graphs' difficulty being 1.
        n_seeds: seeds of each graph.
        never: share of the runs that never arrive.
    """

    r: float
    noise: float
    n_seeds: int
    never: float

    def draw(self, n_graphs: int, rng: np.random.Generator) -> tuple[NDArray, NDArray]:
        """Two measures of each graph, and the outcome of each of its seeds."""
        difficulty = rng.normal(size=(n_graphs, 1))
        measures = self.r * difficulty + np.sqrt(1 - self.r**2) * rng.normal(size=(n_graphs, 2))
        outcomes = difficulty + self.noise * rng.normal(size=(n_graphs, self.n_seeds))
        longest = norm.isf(self.never, scale=np.hypot(1, self.noise))
        return measures, np.where(outcomes > longest, np.inf, outcomes)


POPULATIONS = (
    Population(0.95, 0.1, 10, 0.0),
    Population(0.85, 0.3, 10, 0.0),
    Population(0.85, 1.0, 10, 0.0),
    Population(0.5, 0.3, 10, 0.0),
    Population(0.85, 0.3, 3, 0.0),
    Population(0.85, 1.0, 3, 0.0),
    Population(0.85, 0.3, 10, 0.1),
    Population(0.85, 0.3, 3, 0.1),
)


def correlations(measures: NDArray, outcomes: NDArray) -> NDArray:
    """Return the correlation of the first measure, and its difference from that of the second."""
    first, second = rank_correlations(np.column_stack([medians(outcomes), measures]))[0, 1:]
    return np.array([first, first - second])


def main(options: Options) -> None:
    rng, console = np.random.default_rng(options.seed), Console(stderr=True)
    rows = []
    for population in POPULATIONS:
        truth = np.array([correlations(*population.draw(N_POPULATION, rng))[0], 0])
        held, widths = np.zeros(2), []
        for _ in track(range(options.tables), f"{population}", console=console, transient=True):
            measures, outcomes = population.draw(N_GRAPHS, rng)
            resamples = []
            for _ in range(options.resamples):
                graphs = rng.integers(N_GRAPHS, size=N_GRAPHS)
                resamples.append(correlations(measures[graphs], resampled(outcomes[graphs], rng)))
            pairs = zip(correlations(measures, outcomes), np.transpose(resamples), strict=True)
            found = [interval(value, of_it, options.level) for value, of_it in pairs]
            low, high = np.array([one.low for one in found]), np.array([one.high for one in found])
            held += (low <= truth) & (truth <= high)
            widths.append(high[0] - low[0])
        covered, zero_held = (f"{share:.1%}" for share in held / options.tables)
        described = (f"{population.r}", f"{population.noise}", f"{population.n_seeds}", f"{population.never:.0%}")
        rows.append((*described, f"{truth[0]:.3f}", covered, f"{np.mean(widths):.3f}", zero_held))
    headings = ("r", "noise", "seeds", "never arrive", "truth", "covered", "mean width", "difference holds 0")
    ResultTable(headings, tuple(rows)).publish(options.out)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
