"""Share of intervals of the median ratio that hold 1 on made-up tables of two methods with equal medians.

    python -m benchmarks.study.ratio_coverage

Each graph has a difficulty, the logarithm of its steps, which is standard normal; each seed of either method has normal
noise of its own. On a graph the methods may differ, to either side: the logarithm of their ratio is normal around 0.
Nothing is infinite.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track

from benchmarks.result_table import ResultTable
from benchmarks.study.bootstrap import Bootstrap
from benchmarks.study.paired import Paired

CASES = (
    (1, 3, 0.0, 1.0),
    (1, 10, 0.0, 1.0),
    (4, 3, 0.0, 1.0),
    (12, 3, 0.0, 0.3),
    (12, 3, 0.0, 1.0),
    (79, 3, 0.0, 0.3),
    (79, 3, 0.0, 1.0),
    (4, 3, 1.0, 0.3),
    (4, 3, 1.0, 1.0),
    (12, 3, 1.0, 0.3),
    (12, 3, 1.0, 1.0),
    (79, 3, 1.0, 0.3),
)
"""Number of graphs and of seeds, and the deviations of the graphs' log ratio and of the seeds' noise, that of the
graphs' difficulty being 1."""


@dataclass(frozen=True)
class Options:
    """Count how often 1 is inside.

    Args:
        tables: for each case.
        resamples: of each table.
        seed: of everything.
        out: a file that the table is written to as CSV.
    """

    tables: int = 1000
    resamples: int = 200
    seed: int = 0
    out: Path | None = None


def drawn(n_graphs: int, n_seeds: int, apart: float, noise: float, rng: np.random.Generator) -> Paired:
    """Two methods with a median ratio of 1."""
    difficulty, log_ratio = rng.normal(size=(n_graphs, 1)), apart * rng.normal(size=(n_graphs, 1))
    shape = (n_graphs, n_seeds)
    first, second = (np.exp(mean + noise * rng.normal(size=shape)) for mean in (difficulty, difficulty + log_ratio))
    names = tuple(map(str, range(n_graphs)))
    return Paired("steps_to_50", names, (first, second), (np.ones(n_graphs), np.ones(n_graphs)))


def main(options: Options) -> None:
    rng, console = np.random.default_rng(options.seed), Console(stderr=True)
    rows = []
    for n_graphs, n_seeds, apart, noise in CASES:
        described, n_held = f"{n_graphs} graphs, apart {apart}, noise {noise}", 0
        for number in track(range(options.tables), described, console=console, transient=True):
            found = drawn(n_graphs, n_seeds, apart, noise, rng).median_ratio(Bootstrap(options.resamples, seed=number))
            n_held += found.low <= 1 <= found.high
        rows.append((str(n_graphs), str(n_seeds), f"{apart}", f"{noise}", f"{n_held / options.tables:.1%}"))
    ResultTable(("graphs", "seeds", "apart", "noise", "holds 1"), tuple(rows)).publish(options.out)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
