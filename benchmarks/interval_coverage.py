"""How often 95% intervals of few runs hold the true value, by simulation: the table in docs/compare.md.

python benchmarks/interval_coverage.py
"""

from __future__ import annotations

import numpy as np

from hierroom.compare.estimates import estimate, interquartile_mean, mean

EXPERIMENTS, RESAMPLES = 1000, 500
DISTRIBUTIONS = {
    "normal": lambda generator, n: generator.normal(size=n),
    "skewed": lambda generator, n: generator.beta(8, 2, size=n),
}


def coverage(statistic, draw, n_runs: int, n_graphs: int) -> float:
    """The fraction of experiments whose interval holds the value that very many runs have."""
    generator = np.random.default_rng(0)
    truth = statistic([draw(generator, 1_000_000)[:, None, None]])[0]
    covered = 0
    for seed in range(EXPERIMENTS):
        strata = [draw(generator, n_runs)[:, None, None] for _ in range(n_graphs)]
        found = estimate(strata, statistic, RESAMPLES, seed)
        covered += found.lows[0] <= truth <= found.highs[0]
    return covered / EXPERIMENTS


def main() -> None:
    error = (0.9 * 0.1 / EXPERIMENTS) ** 0.5
    print(f"{EXPERIMENTS} experiments each, {RESAMPLES} resamples, standard errors about {error:.2f}")
    columns = [(statistic, name) for statistic in (interquartile_mean, mean) for name in DISTRIBUTIONS]
    print("| runs on each graph | graphs | " + " | ".join(f"{s.__name__}, {name}" for s, name in columns) + " |")
    for n_graphs, numbers in ((1, (3, 5, 10, 20)), (7, (3, 5, 10))):
        for n_runs in numbers:
            cells = [f"{coverage(s, DISTRIBUTIONS[name], n_runs, n_graphs):.2f}" for s, name in columns]
            print(f"| {n_runs} | {n_graphs} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
