"""In which order the methods come on each goal graph, in the paper and in our runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, NamedTuple

from hierroom.lab.paper.cells import LEAST_SUCCESS
from hierroom.lab.paper.published import METHODS

if TYPE_CHECKING:
    import pandas as pd

_DIGITS = 9
"""Means of the same numbers in another order agree in so many."""
_DASH = 99.9
"""The paper's dash means about the whole limit, as its 99.9 does, and counts as the same number."""
LEGEND = "the best first; = the same number, ~ not told apart by our intervals, of which one seed has none"


class MethodOrder(NamedTuple):
    """The methods on one goal graph, the best first, by the paper's means and by ours.

    Between two names of the paper's stands `>`, or `=` where it prints the same number. Between two of ours stands `>`
    where the 95% intervals lie apart (and success differs by more than `LEAST_SUCCESS`), `=` where they have the same
    mean, else `~`, as always of a single seed, which has no interval.
    """

    graph: str
    paper: str
    ours: str


class PairCounts(NamedTuple):
    """How many pairs of methods, both on the same goal graph, come in the paper's order; its ties are left out."""

    same: int  # our intervals lie apart, as the paper's means do
    opposite: int  # our intervals lie apart, the other way round
    open: int  # our intervals overlap, or are those of a single seed, which has none

    def __str__(self) -> str:
        return (
            f"Of {sum(self)} pairs of methods on the same graph, {self.same} come in the paper's order, "
            f"{self.opposite} in the opposite one, and {self.open} are not told apart."
        )


@dataclass(frozen=True)
class _Method:
    """A method's numbers on a graph, turned so that more is better; ``least`` is what can be told at all."""

    name: str
    paper: float
    ours: float
    half_width: float
    least: float

    def is_better(self, other: _Method) -> bool:
        # Seeds that all end alike have no spread, however few their episodes. NaN of a single seed: never.
        ahead = self.ours - other.ours
        return ahead > self.half_width + other.half_width and ahead > self.least

    def sign_before(self, other: _Method) -> str:
        """What stands between it and the next one."""
        return " = " if self.ours == other.ours else " > " if self.is_better(other) else " ~ "


def method_orders(cells: pd.DataFrame, quantity: str) -> list[MethodOrder]:
    """The order of the methods on each graph, by cells of one grid size.

    Args:
        cells: the cells.
        quantity: `success`, where more is better, or `length`, where less is.
    """
    orders = []
    for graph, methods in _by_graph(cells, quantity):
        by_paper = sorted(methods, key=lambda method: -method.paper)
        by_ours = sorted(methods, key=lambda method: -method.ours)
        paper = [" = " if one.paper == other.paper else " > " for one, other in pairwise(by_paper)]
        ours = [one.sign_before(other) for one, other in pairwise(by_ours)]
        orders.append(MethodOrder(graph, _joined(by_paper, paper), _joined(by_ours, ours)))
    return orders


def pair_counts(cells: pd.DataFrame, quantity: str) -> PairCounts:
    """How often two methods come in the paper's order; arguments as for `method_orders`."""
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


def _joined(methods: Sequence[_Method], between: Sequence[str]) -> str:
    return "".join(name + sign for name, sign in zip([one.name for one in methods], [*between, ""], strict=True))
