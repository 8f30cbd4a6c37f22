"""A chain measured from play: counted transitions between nodes of the augmented graph, and a report on their W.

The paper defines W by the policy that the agent executes. Here W_ij is the fraction of the steps from node i that led
to node j, over many episodes. Two kinds of edges come from the assumed walk and not from the policy. A truncated
episode leads from its last node back to the start, like the walk's restart ("the agent is not able to reach the exit
within the time limit"). The exit has only its restart, with the probability of the assumed walk.

The chain's mean time to the exit is that of the episodes, whatever the policy. Everything else that it says, such as a
standard deviation or a probability within t steps, holds for play only if play is Markov on these nodes. So a report
gives what was observed beside it (`hierroom.complexity.observed`) and tests it (`hierroom.complexity.markov_order`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.complexity.chain import Chain
from hierroom.complexity.episodes import EpisodeCounts
from hierroom.complexity.html import html_table
from hierroom.complexity.markov_order import MarkovTest
from hierroom.complexity.observed import Interval
from hierroom.complexity.played_chain import PlayedChain, summary
from hierroom.complexity.report import REPORT_TIMES, ComplexityReport
from hierroom.complexity.text import text_table
from hierroom.complexity.weights import row_sums
from hierroom.support.errors import InputError


class MoveDifference(NamedTuple):
    """One edge in the assumed walk and in the measured chain: its probabilities per step, and its count in the play."""

    source: str
    target: str
    assumed: float
    measured: float
    count: int


@dataclass(frozen=True, eq=False)
class MeasuredReport:
    """A report on the chain measured from play, next to the predictions of the assumed walk.

    Args:
        assumed: the report of the assumed walk on the same goal graph.
        counts: the transitions of the episodes played; nodes are those of ``assumed.augmented``.
        level: confidence level of the intervals, above 0 and below 1.
        n_resamples: number of bootstrap resamples of whole episodes, at least 2.
        seed: seed of the resamples.
    """

    assumed: ComplexityReport
    counts: EpisodeCounts
    level: float = 0.95
    n_resamples: int = 200
    seed: int = 0

    def __post_init__(self) -> None:
        if self.counts.n_nodes != self.assumed.nodes:
            raise InputError(
                f"the counts are over {self.counts.n_nodes} nodes, but goal graph {self.assumed.graph.name} has "
                f"{self.assumed.nodes}"
            )
        _ = self.played  # so that its level and resamples are checked

    @cached_property
    def played(self) -> PlayedChain:
        """The measured walk and what was observed, without the assumed one."""
        augmented, restart = self.assumed.augmented, self.assumed.walk.restart
        return PlayedChain(
            self.counts,
            augmented.labels,
            augmented.start,
            augmented.goals,
            restart,
            REPORT_TIMES,
            self.level,
            self.n_resamples,
            self.seed,
        )

    @property
    def chain(self) -> Chain:
        """The measured walk; see `PlayedChain.chain`."""
        return self.played.chain

    @property
    def episodes(self) -> int:
        """Number of episodes played."""
        return self.played.episodes

    @property
    def success_rate(self) -> float:
        """Fraction of the episodes that reached the exit."""
        return self.played.success_rate

    @property
    def empirical_steps(self) -> float:
        """Mean number of steps from a start to the next exit; see `PlayedChain.empirical_steps`."""
        return self.played.empirical_steps

    def empirical_reach(self, t: ArrayLike) -> NDArray[np.float64]:
        """Fraction of the episodes that had escaped within t steps; see `PlayedChain.empirical_reach`."""
        return self.played.empirical_reach(t)

    @property
    def observed(self) -> dict[str, Interval]:
        """Mean, deviation and reach of the episodes themselves; see `PlayedChain.observed`."""
        return self.played.observed

    @property
    def markov(self) -> MarkovTest | None:
        """Whether play is Markov on the nodes; see `PlayedChain.markov`."""
        return self.played.markov

    @property
    def intervals(self) -> dict[str, Interval]:
        """Times and reach probabilities of the chain; see `PlayedChain.intervals`."""
        return self.played.intervals

    @cached_property
    def predictions(self) -> dict[str, float]:
        """The prediction of the assumed walk for each of `intervals`."""
        return summary(self.assumed.chain, REPORT_TIMES)

    def moves(self) -> list[MoveDifference]:
        """Every edge of the assumed walk or of the play, the largest difference first.

        Staying is omitted, and so are edges that begin at nodes never visited in the play, about which nothing is
        known.
        """
        assumed, measured, counts = self.assumed.chain.weights, self.chain.weights, self.counts.total()
        edges = (assumed + measured).tocoo()
        labels, visited = self.assumed.augmented.labels, row_sums(counts) > 0
        found = [
            MoveDifference(labels[i], labels[j], float(assumed[i, j]), float(measured[i, j]), int(counts[i, j]))
            for i, j in zip(edges.row.tolist(), edges.col.tolist(), strict=True)
            if i != j and visited[i]
        ]
        return sorted(found, key=lambda move: -abs(move.assumed - move.measured))

    def to_dict(self) -> dict[str, Any]:
        """The report as plain numbers, strings, lists and dicts."""
        return {
            "graph": self.assumed.graph.name,
            "key_rooms": {f"key {room}": home for room, home in enumerate(self.assumed.graph.key_rooms, start=1)},
            "exit_room": self.assumed.graph.exit_room,
            "drop_key": self.assumed.drop_key,
            **self.played.to_dict(),
            "assumed": self.predictions,
            "moves": [move._asdict() for move in self.moves()],
        }

    @property
    def _head(self) -> str:
        played = f"{self.episodes} episode{'s' * (self.episodes > 1)} played"
        return f"goal graph {self.assumed.graph.name}, {played}, {self.success_rate:.1%} escaped"

    @property
    def _columns(self) -> tuple[str, ...]:
        name, *columns = self.played.columns
        return name, "assumed walk", *columns

    def _rows(self) -> list[tuple[str, ...]]:
        return [(name, f"{self.predictions[name]:.4g}", *cells) for name, *cells in self.played.rows()]

    def _notes(self) -> list[str]:
        unforeseen = sum(move.count for move in self.moves() if move.assumed == 0)
        return [
            f"{unforeseen} of {self.counts.counts.sum()} steps took an edge that the assumed walk lacks",
            *self.played.notes(),
        ]

    def __str__(self) -> str:
        return text_table(self._head, self._columns, self._rows(), self._notes())

    def _repr_html_(self) -> str:
        """What notebooks show."""
        return html_table(self._head, self._columns, self._rows(), self._notes())
