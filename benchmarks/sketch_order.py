"""Is PPO above PPO+Sketch on larger grids where PPO has the paper's success? The rule is in sweeps/sketch_size25.toml.

    python -m benchmarks.sketch_order

The steps come from three seeds of the paper's Table 3 on grids of 25, the success there from five other seeds. `pairs`
is in how many of the pairs of a seed of each method PPO is ahead, ties counted by half. `lead` is the lead of its mean
in points of success, with the 95% interval of Welch's test; `paper's lead` is that of the paper. `by chance` is how
often PPO would lead an equal method as far, with five seeds each, as in the paper, drawn from our ten on the graph. The
last row sums over the graphs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import combinations
from pathlib import Path

import numpy as np
import tyro
from numpy.typing import NDArray
from scipy.stats import ttest_ind

from benchmarks.committed import ROOT, done_rows, plan_of
from benchmarks.paper.cells import table_3, values_at
from benchmarks.paper.published import PAPER_TABLE_3
from benchmarks.paper.runs import PaperRuns, cell
from benchmarks.result_table import ResultTable
from hierroom.lab.sweep.table import SweepTable
from hierroom.support.cli import run

SWEEP, SIZE = "sketch_size25", 25
PAPER_SEEDS, DRAWS = 5, 100_000
HEADINGS = ("graph", "steps", "PPO", "PPO+Sketch", "pairs", "p", "lead", "paper's lead", "by chance")


@dataclass(frozen=True)
class Options:
    """Compare the two methods."""

    out: Path | None = None
    """A file that the table is written to as CSV."""


@dataclass(frozen=True)
class PairsAhead:
    """In how many pairs of seeds a method is ahead of another, and what chance would give.

    Args:
        twice: the doubled number; a tie counts 1.
        n: of pairs.
        chances: [2n + 1] the probability of each doubled number where the methods are equal.
    """

    twice: int
    n: int
    chances: NDArray[np.float64]

    @classmethod
    def of(cls, first: NDArray[np.float64], second: NDArray[np.float64]) -> PairsAhead:
        """Return the pairs of two methods' seeds; chance is every way to share out all values among the methods.

        Args:
            first: [A] a value for each seed of the method.
            second: [B] a value for each seed of the other.
        """
        values = np.concatenate([first, second])
        everyone = np.arange(len(values))
        splits = [np.isin(everyone, chosen) for chosen in combinations(everyone, len(first))]
        ahead = [int((1 + np.sign(values[own, None] - values[~own])).sum()) for own in splits]
        n = len(first) * len(second)
        return cls(ahead[0], n, np.bincount(ahead, minlength=2 * n + 1) / len(ahead))

    def __add__(self, other: PairsAhead) -> PairsAhead:
        """Those of both, shared out independently."""
        return PairsAhead(self.twice + other.twice, self.n + other.n, np.convolve(self.chances, other.chances))

    @property
    def p_value(self) -> float:
        """The probability of as many or more, one-sided."""
        return float(self.chances[self.twice :].sum())

    def cells(self) -> tuple[str, str]:
        """Return the number of pairs, and the probability."""
        return f"{self.twice / 2:g} of {self.n}", f"{self.p_value:.3f}"


def steps_to_the_papers_success() -> dict[str, float]:
    """By graph, the steps at which the median of the first three seeds of PPO has the paper's success."""
    paper = PaperRuns(ROOT / "benchmarks" / "results" / "paper", seeds=3, sizes=(SIZE,))
    sweep = paper.sweep("abde", ["ppo"])
    rows = done_rows("paper", sweep.plan.runs())
    return dict(table_3(rows, sweep.table.curves(), paper.sizes).set_index("graph")["steps_to_paper"])


def table() -> ResultTable:
    """Return the two methods on each graph, and on all."""
    rows = done_rows(SWEEP, plan_of(SWEEP).runs())
    curves, rng = SweepTable(ROOT / "benchmarks" / "results" / SWEEP).curves(), np.random.default_rng(0)
    lines, found, leads, chances = [], [], [], []
    for graph, at in steps_to_the_papers_success().items():
        values = [
            values_at(at, cell(rows, method, graph, SIZE), curves, "success_rate") for method in ("ppo", "ppo-sketch")
        ]
        found.append(PairsAhead.of(*values))
        lead = PAPER_TABLE_3["ppo", graph].success - PAPER_TABLE_3["ppo-sketch", graph].success
        leads.append(lead)
        chances.append(leads_by_chance(100 * np.concatenate(values), rng))
        shown = (*map(_spread, values), *found[-1].cells(), _lead(*values), f"{lead:.1f}")
        lines.append((graph, f"{at / 1e6:.2f}M", *shown, _share(chances[-1] >= lead)))
    together, in_all = reduce(PairsAhead.__add__, found), sum(leads)
    by_chance = _share(np.sum(chances, axis=0) >= in_all)
    return ResultTable(HEADINGS, (*lines, ("all", "", "", "", *together.cells(), "", f"{in_all:.1f}", by_chance)))


def leads_by_chance(values: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return how far the mean of as many seeds as the paper has is above that of others from the same values [D].

    Args:
        values: [S] one for each seed.
        rng: draws them.
    """
    first, second = rng.choice(values, (2, DRAWS, PAPER_SEEDS)).mean(axis=2)
    return first - second


def _share(happens: NDArray[np.bool_]) -> str:
    return f"{happens.mean():.3f}"


def _lead(first: NDArray[np.float64], second: NDArray[np.float64]) -> str:
    low, high = 100 * np.array(ttest_ind(first, second, equal_var=False).confidence_interval())
    return f"{100 * (first.mean() - second.mean()):.1f} [{low:.1f}, {high:.1f}]"


def _spread(values: Sequence[float] | NDArray[np.float64]) -> str:
    """Return the median, and from the lowest to the highest."""
    return f"{np.median(values):.1%} ({np.min(values):.1%} to {np.max(values):.1%})"


def main() -> int:
    """Run the command."""
    options = tyro.cli(Options, description=__doc__)
    table().publish(options.out)
    return 0


if __name__ == "__main__":
    run(main)
