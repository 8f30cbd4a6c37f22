"""A chain measured from play: counted transitions between nodes of the augmented graph, and a report on their W.

The paper defines W by the policy that the agent executes. Here W_ij is the fraction of the steps from node i that led
to node j, over many episodes. Two kinds of edges come from the assumed walk and not from the policy. A truncated
episode leads from its last node back to the start, like the walk's restart ("the agent is not able to reach the exit
within the time limit"). The exit has only its restart, with the probability of the assumed walk.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from hierroom.complexity.chain import EXIT, Chain
from hierroom.complexity.html import html_table
from hierroom.complexity.report import REPORT_TIMES, ComplexityReport
from hierroom.complexity.weights import as_times, row_sums
from hierroom.errors import InputError


@dataclass(frozen=True, eq=False)
class EpisodeCounts:
    """How often each episode moved from one node to another; staying at a node counts as a transition too.

    Args:
        n_nodes: number of nodes n.
        episodes: [K] int64, the episode of each entry, 0 to ``len(lengths) - 1``.
        sources: [K] int64, the node where the step began.
        targets: [K] int64, the node where it ended.
        counts: [K] int64, number of such steps in the episode.
        lengths: [E] int64, number of steps of each episode.
        escaped: [E] bool, whether the episode reached the exit.
    """

    n_nodes: int
    episodes: NDArray[np.int64]
    sources: NDArray[np.int64]
    targets: NDArray[np.int64]
    counts: NDArray[np.int64]
    lengths: NDArray[np.int64]
    escaped: NDArray[np.bool_]

    def total(self, multiplicity: ArrayLike | None = None) -> sp.csr_array:
        """Sum the transitions over the episodes.

        Args:
            multiplicity: [E] number of times each episode counts; once by default.

        Returns:
            [n, n] float64 CSR.
        """
        times = np.ones(len(self.lengths)) if multiplicity is None else np.asarray(multiplicity, float)
        shape = (self.n_nodes, self.n_nodes)
        return sp.coo_array((self.counts * times[self.episodes], (self.sources, self.targets)), shape=shape).tocsr()


def counts_of(
    keys: NDArray[np.int64], n_nodes: int, lengths: NDArray[np.int64], escaped: NDArray[np.bool_]
) -> EpisodeCounts:
    """Count transitions that are encoded as one number each, ``(episode * n + source) * n + target``."""
    unique, counts = np.unique(keys, return_counts=True)
    rest, targets = np.divmod(unique, n_nodes)
    episodes, sources = np.divmod(rest, n_nodes)
    return EpisodeCounts(n_nodes, episodes, sources, targets, counts, lengths, escaped)


class Interval(NamedTuple):
    """A measured value and its bootstrap confidence interval."""

    value: float
    low: float
    high: float


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

    Raises:
        InputError: if the counts belong to another graph, or the level or number of resamples is out of range.
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
        if not 0 < self.level < 1 or self.n_resamples < 2:
            raise InputError(
                "intervals need a level between 0 and 1 and at least 2 resamples, "
                f"not {self.level} and {self.n_resamples}"
            )

    @cached_property
    def chain(self) -> Chain:
        """The measured walk: a `Chain` with W from the counts."""
        return self._chain(self.counts.total())

    @property
    def episodes(self) -> int:
        """Number of episodes played."""
        return len(self.counts.lengths)

    @property
    def success_rate(self) -> float:
        """Fraction of the episodes that reached the exit."""
        return float(self.counts.escaped.mean())

    @property
    def empirical_steps(self) -> float:
        """Mean number of steps from a start to the next exit over consecutive episodes; ``inf`` if none escaped.

        It is the number of all steps plus one for each restart, divided by the number of escapes. The measured chain's
        `expected_steps` is the same number for any policy, because its counts balance at every node and this is their
        stationary return time.
        """
        n_escaped = int(self.counts.escaped.sum())
        steps = int(self.counts.lengths.sum()) + self.episodes - n_escaped
        return steps / n_escaped if n_escaped else float("inf")

    def empirical_reach(self, t: ArrayLike) -> NDArray[np.float64]:
        """Fraction of the episodes that had escaped within t steps; meaningful up to the step limit.

        A difference from `chain.reach_probability` shows that the nodes are not Markov states: the policy's next step
        depends on more than the node, for example on the distance to the next object.
        """
        steps = as_times(t)
        ends = np.sort(self.counts.lengths[self.counts.escaped])
        return np.searchsorted(ends, steps, side="right") / self.episodes

    @cached_property
    def intervals(self) -> dict[str, Interval]:
        """Times to the exit and to each goal, and reach probabilities, with percentile intervals over episodes.

        Episodes are resampled with replacement and the whole report is computed again (Efron and Tibshirani, 1993,
        chapter 13). A resample without an escape has infinite times, so an interval may end at ``inf``.
        """
        rng = np.random.default_rng(self.seed)
        share = np.full(self.episodes, 1 / self.episodes)
        resamples = [
            _summary(self._chain(self.counts.total(rng.multinomial(self.episodes, share))))
            for _ in range(self.n_resamples)
        ]
        tails = ((1 - self.level) / 2, (1 + self.level) / 2)
        intervals = {}
        for name, value in _summary(self.chain).items():
            drawn = [resample[name] for resample in resamples]
            low, high = np.quantile(drawn, tails, method="inverted_cdf")
            intervals[name] = Interval(value, float(low), float(high))
        return intervals

    @cached_property
    def predictions(self) -> dict[str, float]:
        """The prediction of the assumed walk for each of `intervals`."""
        return _summary(self.assumed.chain)

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
            "episodes": self.episodes,
            "success_rate": self.success_rate,
            "empirical_steps": self.empirical_steps,
            "level": self.level,
            "measured": {name: interval._asdict() for name, interval in self.intervals.items()},
            "assumed": self.predictions,
            "empirical_reach": dict(
                zip(map(str, REPORT_TIMES), self.empirical_reach(REPORT_TIMES).tolist(), strict=True)
            ),
            "expected_states": dict(
                zip(map(str, REPORT_TIMES), self.chain.expected_states(REPORT_TIMES).tolist(), strict=True)
            ),
            "goal_sensitivity": self.chain.goal_sensitivity(),
            "moves": [move._asdict() for move in self.moves()],
        }

    @property
    def _head(self) -> str:
        return f"goal graph {self.assumed.graph.name}, {self.episodes} episodes played, {self.success_rate:.1%} escaped"

    @property
    def _columns(self) -> tuple[str, ...]:
        return "", "assumed walk", "episodes", "their chain", f"{self.level:.0%} interval"

    def _rows(self) -> list[tuple[str, ...]]:
        counted = {"expected_steps": self.empirical_steps}
        counted |= {
            _within(t): float(share) for t, share in zip(REPORT_TIMES, self.empirical_reach(REPORT_TIMES), strict=True)
        }
        rows = []
        for name, (value, low, high) in self.intervals.items():
            seen = f"{counted[name]:.4g}" if name in counted else ""
            rows.append((name, f"{self.predictions[name]:.4g}", seen, f"{value:.4g}", f"{low:.4g} to {high:.4g}"))
        return rows

    def _notes(self) -> list[str]:
        unforeseen = sum(move.count for move in self.moves() if move.assumed == 0)
        notes = [f"{unforeseen} of {self.counts.counts.sum()} steps took an edge that the assumed walk lacks"]
        if not self.counts.escaped.any():
            notes.append("nobody escaped, so the times to the exit are infinite")
        return notes

    def __str__(self) -> str:
        lines = [
            f"  {name:<18}{assumed:>14}{seen:>12}{measured:>14}   {interval}"
            for name, assumed, seen, measured, interval in (self._columns, *self._rows())
        ]
        return "\n".join([self._head, *lines, *(f"  {note}" for note in self._notes())])

    def _repr_html_(self) -> str:
        """What notebooks show."""
        return html_table(self._head, self._columns, self._rows(), self._notes())

    def _chain(self, counts: sp.csr_array) -> Chain:
        augmented = self.assumed.augmented
        steps = row_sums(counts)
        from_exit = sp.coo_array(
            ([self.assumed.walk.restart], ([augmented.exit], [augmented.start])), shape=counts.shape
        )
        shares = counts.multiply(1 / np.maximum(steps, 1)[:, None])  # a node never visited keeps a row of zeros
        return Chain((shares + from_exit).tocsr(), augmented.labels, augmented.start, augmented.goals)


def _within(t: int) -> str:
    return f"exit within {t}"


def _summary(chain: Chain) -> dict[str, float]:
    reached = chain.reach_probability(REPORT_TIMES)
    times = {"hitting_time": chain.hitting_time, "expected_steps": chain.expected_steps, "std": chain.std}
    chances = {_within(t): float(chance) for t, chance in zip(REPORT_TIMES, reached, strict=True)}
    return times | chances | {f"steps to {goal}": chain.expected_steps_to(goal) for goal in chain.goals if goal != EXIT}
