"""The report on how hard a chain is to explore."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse.csgraph import dijkstra

from hierroom.complexity.chains.chain import EXIT, Chain
from hierroom.complexity.chains.walk import Walk
from hierroom.complexity.chains.weights import as_moves
from hierroom.complexity.walk_report import WalkReport

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class ChainReport(WalkReport):
    """Passage times of a chain; created by `analyze`.

    Args:
        chain: the walk.
        walk: the probabilities of one step if the chain is the paper's walk on a graph; else None.

    Examples:
        >>> import networkx as nx
        >>> report = hierroom.complexity.analyze(nx.path_graph(4), source=0, target=3)
        >>> report.name, round(report.expected_steps, 1)
        ('0 to 3', 50.8)
    """

    chain: Chain
    walk: Walk | None = None

    @property
    def name(self) -> str:
        """The labels of the chain's start and exit."""
        first, last = (self.chain.labels[node] for node in (self.chain.source, self.chain.goals[EXIT][0]))
        return f"{first} to {last}"

    @cached_property
    def exit_depth(self) -> float:
        """Number of nodes between the start and the exit on the shortest path; ``inf`` if there is none."""
        moves = as_moves(self.chain.weights)
        steps = dijkstra(moves, indices=self.chain.source, unweighted=True)
        return float(steps[self.chain.goals[EXIT][0]]) - 1

    @property
    def width(self) -> None:
        """None: only goals that depend on each other have a width."""

    @property
    def edges(self) -> int:
        """Number of moves between two different nodes, restarts included."""
        return as_moves(self.chain.weights).nnz

    def described(self) -> dict[str, Any]:
        """Return a description of the chain, as plain types."""
        return {"chain": self.name}

    @property
    def _head(self) -> str:
        return f"chain from {self.name}"

    def _first_lines(self) -> list[tuple[str, str]]:
        depth = "inf" if np.isinf(self.exit_depth) else f"{self.exit_depth:.0f}"
        return [("exit depth", depth), ("chain", f"{self.nodes} nodes, {self.edges} edges with restarts")]

    def _figure(self) -> Figure:
        from hierroom.complexity.drawing.draw import figure_of_chain

        return figure_of_chain(self.chain, self.walk.restart if self.walk else 0.0)
