"""Agreement of our runs with the paper: the order of the methods, and how well the hitting time predicts learning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, NamedTuple

from scipy.stats import permutation_test, spearmanr

from benchmarks.paper.cells import LEAST_SUCCESS
from benchmarks.paper.published import METHODS, PAPER_TABLE_2, PAPER_TABLE_3

if TYPE_CHECKING:
    import pandas as pd

_DIGITS = 9  # digits in which means of the same numbers agree, whatever the order of summing
_FEWEST = 4  # graphs; the ranks of fewer agree too often by chance
_ALL = 10_000  # more than the orders of seven graphs, so that a permutation test uses all of them
_DASH = 99.9  # the paper's dash means about the whole limit, like its 99.9
LEGEND = "the best first; = the same number, ~ no significant difference by our intervals; one seed has none"


class MethodOrder(NamedTuple):
    """The methods on one goal graph, the best first, by the paper's means and by ours.

    In our order, `=` means equal means, and `>` that the 95% intervals do not overlap (and success differs by more than
    `LEAST_SUCCESS`). Other pairs have `~`, such as those with a single seed, which has no interval.
    """

    graph: str
    paper: str
    ours: str


class PairCounts(NamedTuple):
    """Counts of pairs of methods on the same goal graph in the paper's or another order, without the paper's ties."""

    same: int
    opposite: int
    open: int  # no significant difference: our intervals overlap, or a single seed has none

    def __str__(self) -> str:
        return (
            f"Of {sum(self)} pairs of methods on the same graph, {self.same} come in the paper's order, "
            f"{self.opposite} in the opposite one, and {self.open} show no significant difference."
        )


@dataclass(frozen=True)
class _Method:
    """A method's numbers on a graph, signed so that more is better; smaller differences than ``least`` are ignored."""

    name: str
    paper: float
    ours: float
    half_width: float
    least: float

    def is_better(self, other: _Method) -> bool:
        # Seeds with equal results have no spread, even with few episodes: `least` guards. With one seed, NaN: False.
        ahead = self.ours - other.ours
        return ahead > self.half_width + other.half_width and ahead > self.least


def method_orders(cells: pd.DataFrame, quantity: str) -> list[MethodOrder]:
    """Return the order of the methods on each graph, by the ``success`` or ``length`` in cells of one grid size."""
    orders = []
    for graph, methods in _by_graph(cells, quantity):
        by_paper = sorted(methods, key=lambda method: -method.paper)
        by_ours = sorted(methods, key=lambda method: -method.ours)
        paper, ours = by_paper[0].name, by_ours[0].name
        for one, other in pairwise(by_paper):
            paper += f" {'=' if one.paper == other.paper else '>'} {other.name}"
        for one, other in pairwise(by_ours):
            ours += f" {'=' if one.ours == other.ours else '>' if one.is_better(other) else '~'} {other.name}"
        orders.append(MethodOrder(graph, paper, ours))
    return orders


def pair_counts(cells: pd.DataFrame, quantity: str) -> PairCounts:
    """Count pairs of methods in the paper's order or not, by ``success`` or ``length`` in cells of one grid size."""
    same = opposite = n = 0
    for _, methods in _by_graph(cells, quantity):
        for one, other in combinations(methods, 2):
            if one.paper != other.paper:
                better, worse = (one, other) if one.paper > other.paper else (other, one)
                n, same, opposite = n + 1, same + better.is_better(worse), opposite + worse.is_better(better)
    return PairCounts(same, opposite, n - same - opposite)


def _by_graph(cells: pd.DataFrame, quantity: str) -> list[tuple[str, list[_Method]]]:
    import pandas as pd

    sign, least = (1, LEAST_SUCCESS) if quantity == "success" else (-1, 0.0)
    numbers = pd.DataFrame({
        "name": cells["method"].map(METHODS),
        "paper": sign * cells[f"paper_{quantity}"].fillna(_DASH),
        "ours": (sign * cells[quantity]).round(_DIGITS),
        "half_width": cells[f"{quantity}_half_width"],
        "least": least,
    })  # fmt: skip
    by_graph = numbers.groupby(cells["graph"], sort=False)
    return [(str(graph), [_Method(*one) for one in own.itertuples(index=False)]) for graph, own in by_graph]


def prediction(cells: pd.DataFrame) -> str:
    """Return a sentence with Spearman's correlations (and p) between the hitting time and HiPPO's cells of one size."""
    own = cells[cells["method"] == "hippo"]
    if len(own) < _FEWEST:
        return ""
    times = [PAPER_TABLE_2[graph].hitting_time for graph in own["graph"]]

    def correlation(values: Sequence[float]) -> str:
        if len(set(values)) < 2:
            return "none (all are equal)"
        test = permutation_test(
            (values,), lambda shuffled: spearmanr(times, shuffled)[0], permutation_type="pairings", n_resamples=_ALL
        )
        return f"{test.statistic:.2f} (p = {test.pvalue:.2f})"

    parts = [
        f"{quantity} in our runs {correlation([*own[quantity]])}, "
        f"in the paper {correlation([getattr(PAPER_TABLE_3['hippo', graph], quantity) for graph in own['graph']])}"
        for quantity in ("success", "length")
    ]
    parts.append(f"steps to 95% in our runs {correlation([*own['steps_to_95']])}")
    over = f"on {len(own)} graphs (p by an exact permutation test)"
    return f"Rank correlations of the paper's hitting time with HiPPO's results {over}: {'; '.join(parts)}."
