"""In which order the methods come on each goal graph, in the paper and in our runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

from hierroom.lab.paper.cells import LEAST_SUCCESS, ComparedCell
from hierroom.lab.paper.published import METHODS

_DIGITS = 9
"""Means of the same numbers in another order agree in so many."""
LEGEND = "the best first; = the same number, ~ not told apart by our intervals, of which one seed has none"


@dataclass(frozen=True)
class MethodOrder:
    """The methods on one goal graph, the best first.

    Args:
        graph: a to g.
        paper: the names by the paper's means, `>` between two, `=` where it prints the same number.
        ours: the names by our means, `>` where the 95% intervals of two neighbours lie apart (and success differs by
            more than `LEAST_SUCCESS`), `=` where they have the same mean, else `~`, as always of a single seed, which
            has no interval.
    """

    graph: str
    paper: str
    ours: str


@dataclass(frozen=True)
class PairCounts:
    """How many pairs of methods, both on the same goal graph, come in the paper's order; its ties are left out.

    Args:
        same: our intervals lie apart, as the paper's means do.
        opposite: our intervals lie apart, the other way round.
        open: our intervals overlap, or are those of a single seed, which has none.
    """

    same: int
    opposite: int
    open: int

    def __str__(self) -> str:
        """One sentence."""
        n = self.same + self.opposite + self.open
        return (
            f"Of {n} pairs of methods on the same graph, {self.same} come in the paper's order, {self.opposite} in the "
            f"opposite one, and {self.open} are not told apart."
        )


@dataclass(frozen=True)
class _Method:
    """A method's numbers on a graph, turned so that more is better; ``least`` is what can be told at all."""

    name: str
    paper: float
    ours: float
    half_width: float
    least: float = 0.0

    def is_better(self, other: _Method) -> bool:
        # Seeds that all end alike have no spread, however few their episodes. NaN of a single seed: never.
        ahead = self.ours - other.ours
        return ahead > self.half_width + other.half_width and ahead > self.least

    def sign_before(self, other: _Method) -> str:
        """What stands between it and the next one."""
        return " = " if self.ours == other.ours else " > " if self.is_better(other) else " ~ "


def method_orders(cells: Sequence[ComparedCell], quantity: str) -> list[MethodOrder]:
    """The order of the methods on each graph.

    Args:
        cells: of one grid size.
        quantity: `success`, of which more is better, or `length`, of which less is.
    """
    orders = []
    for graph in dict.fromkeys(cell.graph for cell in cells):
        methods = _methods(cells, graph, quantity)
        by_paper = sorted(methods, key=lambda method: -method.paper)
        by_ours = sorted(methods, key=lambda method: -method.ours)
        paper = [" = " if one.paper == other.paper else " > " for one, other in pairwise(by_paper)]
        ours = [one.sign_before(other) for one, other in pairwise(by_ours)]
        orders.append(MethodOrder(graph, _joined(by_paper, paper), _joined(by_ours, ours)))
    return orders


def pair_counts(cells: Sequence[ComparedCell], quantity: str) -> PairCounts:
    """How often two methods come in the paper's order.

    Args:
        cells: of one grid size.
        quantity: `success` or `length`.
    """
    same = opposite = n = 0
    for graph in dict.fromkeys(cell.graph for cell in cells):
        for one, other in combinations(_methods(cells, graph, quantity), 2):
            if one.paper == other.paper:
                continue
            better, worse = (one, other) if one.paper > other.paper else (other, one)
            n, same, opposite = n + 1, same + better.is_better(worse), opposite + worse.is_better(better)
    return PairCounts(same, opposite, n - same - opposite)


def _methods(cells: Sequence[ComparedCell], graph: str, quantity: str) -> list[_Method]:
    own = [cell for cell in cells if cell.graph == graph]
    if quantity == "success":
        told = [(one.paper_success, round(one.success, _DIGITS), one.success_half_width, LEAST_SUCCESS) for one in own]
    else:
        told = [(-_printed_length(one), -round(one.length, _DIGITS), one.length_half_width, 0.0) for one in own]
    return [_Method(METHODS[one.method], *numbers) for one, numbers in zip(own, told, strict=True)]


def _printed_length(cell: ComparedCell) -> float:
    """The paper's; its dash means about the whole limit, as its 99.9 does, and counts as the same number."""
    return 99.9 if cell.paper_length is None else cell.paper_length


def _joined(methods: Sequence[_Method], between: Sequence[str]) -> str:
    return "".join(name + sign for name, sign in zip([one.name for one in methods], [*between, ""], strict=True))
