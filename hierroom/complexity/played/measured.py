"""A report on the chain measured from play: its W comes from counted transitions between nodes of the augmented graph.

Two kinds of edges come from the assumed walk. A truncated episode leads back to the start, like the walk's restart
("the agent is not able to reach the exit within the time limit"). The only edge of the exit is its restart.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

from hierroom.complexity.chains.weights import row_sums
from hierroom.complexity.played.observed import EpisodeCounts
from hierroom.complexity.played.played_chain import PlayedChain, summary
from hierroom.complexity.report import ComplexityReport
from hierroom.support.errors import InputError


class MoveDifference(NamedTuple):
    """One edge in the assumed walk and in the measured chain."""

    source: str
    target: str
    assumed: float  # probability per step
    measured: float  # probability per step
    count: int  # number of times in play


class MeasuredReport(PlayedChain):
    """A report on the chain measured from play, with the predictions of the assumed walk.

    Args:
        counts: the transitions between the nodes of ``assumed.augmented``.
        options: ``level``, ``n_resamples`` and ``seed`` as in `PlayedChain`.
    """

    assumed: ComplexityReport

    def __init__(self, assumed: ComplexityReport, counts: EpisodeCounts, **options: Any) -> None:
        object.__setattr__(self, "assumed", assumed)  # because the class is frozen
        if counts.n_nodes != assumed.nodes:
            raise InputError(
                f"the counts are over {counts.n_nodes} nodes, but goal graph {assumed.graph.name} has {assumed.nodes}"
            )
        chain = assumed.chain
        super().__init__(counts, chain.labels, chain.source, chain.goals, assumed.walk.restart, **options)

    @cached_property
    def predictions(self) -> dict[str, float]:
        """The assumed walk's prediction of each quantity in `intervals`."""
        return summary(self.assumed.chain, self.times)

    def moves(self) -> list[MoveDifference]:
        """Return every edge from a visited node, in the assumed walk or in play, the largest difference first."""
        assumed, measured, counts = self.assumed.chain.weights, self.chain.weights, self.counts.total()
        edges = (assumed + measured).tocoo()
        labels, visited = self.labels, row_sums(counts) > 0
        found = [
            MoveDifference(labels[i], labels[j], float(assumed[i, j]), float(measured[i, j]), int(counts[i, j]))
            for i, j in zip(edges.row.tolist(), edges.col.tolist(), strict=True)
            if i != j and visited[i]
        ]
        return sorted(found, key=lambda move: -abs(move.assumed - move.measured))

    def to_dict(self) -> dict[str, Any]:
        """Return the report as plain numbers, strings, lists and dicts."""
        return {
            **self.assumed.described(),
            **super().to_dict(),
            "assumed": self.predictions,
            "moves": [move._asdict() for move in self.moves()],
        }

    @property
    def _head(self) -> str:
        played = f"{self.episodes} episode{'s' * (self.episodes > 1)} played"
        return f"goal graph {self.assumed.graph.name}, {played}, {self.success_rate:.1%} escaped"

    @property
    def columns(self) -> tuple[str, ...]:
        """The headings of `rows`."""
        name, *columns = super().columns
        return name, "assumed walk", *columns

    def rows(self) -> list[tuple[str, ...]]:
        """Return the rows of `PlayedChain`, each with the prediction of the assumed walk."""
        return [(name, f"{self.predictions[name]:.4g}", *cells) for name, *cells in super().rows()]

    def notes(self) -> list[str]:
        """Return sentences that explain `rows`."""
        unforeseen = sum(move.count for move in self.moves() if move.assumed == 0)
        steps = self.counts.counts.sum()
        return [f"{unforeseen} of {steps} steps took an edge that the assumed walk lacks", *super().notes()]
