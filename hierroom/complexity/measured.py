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
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from hierroom.complexity.chain import EXIT, Chain
from hierroom.complexity.episodes import EpisodeCounts
from hierroom.complexity.html import html_table
from hierroom.complexity.markov_order import MarkovTest, markov_test
from hierroom.complexity.observed import (
    Interval,
    observed,
    observed_steps,
    percentile_interval,
    wilson_interval,
    within,
)
from hierroom.complexity.report import REPORT_TIMES, ComplexityReport
from hierroom.complexity.weights import row_sums
from hierroom.errors import InputError


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
        return observed_steps(self.counts)

    def empirical_reach(self, t: ArrayLike) -> NDArray[np.float64]:
        """Fraction of the episodes that had escaped within t steps; ``nan`` past the step limit.

        A difference from `chain.reach_probability` shows that the nodes are not Markov states: the policy's next step
        depends on more than the node, for example on the distance to the next object.
        """
        return self.counts.reach(t)

    @cached_property
    def observed(self) -> dict[str, Interval]:
        """Mean, deviation and reach of the episodes themselves, with intervals; see `complexity.observed.observed`."""
        rng = np.random.default_rng([self.seed, 1])
        return observed(self.counts, REPORT_TIMES, self.level, 5 * self.n_resamples, rng)

    @cached_property
    def markov(self) -> MarkovTest | None:
        """Whether play is Markov on the nodes; None if the counts do not suffice, see `complexity.markov_order`."""
        return None if self.counts.triples is None else markov_test(self.counts.triples)

    @cached_property
    def intervals(self) -> dict[str, Interval]:
        """Times to the exit and to each goal, and reach probabilities, of the chain, with intervals over episodes.

        Episodes are resampled with replacement and the whole report is computed again (Efron and Tibshirani, 1993,
        chapter 13). So an interval covers what the chain would be after very many episodes, which is what play does
        only if `markov` is not rejected. A resample without an escape has infinite times, so an interval may end at
        ``inf``. Where the resamples do not differ or the episodes are few, a time has no interval, and that of a
        probability is as wide as Wilson's at least.
        """
        rng = np.random.default_rng(self.seed)
        share = np.full(self.episodes, 1 / self.episodes)
        resamples = [
            _summary(self._chain(self.counts.total(rng.multinomial(self.episodes, share))))
            for _ in range(self.n_resamples)
        ]
        intervals = {}
        for name, value in _summary(self.chain).items():
            drawn = [resample[name] for resample in resamples]
            intervals[name] = percentile_interval(value, drawn, self.episodes, self.level)
            if name.startswith("exit within") and np.isnan(intervals[name].low):
                intervals[name] = wilson_interval(value, self.episodes, self.level)
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
            "observed": {name: interval._asdict() for name, interval in self.observed.items()},
            "markov_test": None if self.markov is None else self.markov._asdict(),
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
        played = f"{self.episodes} episode{'s' * (self.episodes > 1)} played"
        return f"goal graph {self.assumed.graph.name}, {played}, {self.success_rate:.1%} escaped"

    @property
    def _columns(self) -> tuple[str, ...]:
        interval = f"{self.level:.0%} interval"
        return "", "assumed walk", "observed", interval, "their chain", interval

    def _rows(self) -> list[tuple[str, ...]]:
        rows = []
        for name, measured in self.intervals.items():
            seen = self.observed.get(name)
            cells = (
                ("", "") if seen is None else ("-", "") if np.isnan(seen.value) else (f"{seen.value:.4g}", str(seen))
            )
            rows.append((name, f"{self.predictions[name]:.4g}", *cells, f"{measured.value:.4g}", str(measured)))
        return rows

    def _notes(self) -> list[str]:
        unforeseen = sum(move.count for move in self.moves() if move.assumed == 0)
        notes = [
            f"{unforeseen} of {self.counts.counts.sum()} steps took an edge that the assumed walk lacks",
            *self._test_notes(),
        ]
        if not self.counts.escaped.any():
            notes.append("nobody escaped, so the times to the exit are infinite")
        if self.counts.step_limit < REPORT_TIMES[-1]:
            notes.append(f"-: not observed, as episodes were truncated after {self.counts.step_limit:.0f} steps")
        if any(np.isnan(interval.low) for interval in self.intervals.values()):
            notes.append("none: the episodes are too few, or too much alike, for an interval")
        return notes

    def _test_notes(self) -> list[str]:
        """Whether the chain's numbers are those of play."""
        if self.markov is None:
            return ["too few steps to test whether play is Markov on these nodes: trust what was observed"]
        test = f"Markov of order 1 against 2: chi2({self.markov.degrees}) = {self.markov.statistic:.1f}"
        if not self.markov.is_rejected:
            return [f"{test}, p = {self.markov.p_value:.2g}: nothing speaks against the chain"]
        return [
            f"{test}, p = {self.markov.p_value:.1g}: play is NOT Markov on these nodes. The chain's expected steps",
            "are those of play all the same; its other numbers and intervals are not: read what was observed instead",
        ]

    def __str__(self) -> str:
        lines = [
            f"  {name:<16}{assumed:>13}{seen:>11}   {covers:<18}{measured:>12}   {interval}".rstrip()
            for name, assumed, seen, covers, measured, interval in (self._columns, *self._rows())
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


def _summary(chain: Chain) -> dict[str, float]:
    reached = chain.reach_probability(REPORT_TIMES)
    times = {"hitting_time": chain.hitting_time, "expected_steps": chain.expected_steps, "std": chain.std}
    chances = {within(t): float(chance) for t, chance in zip(REPORT_TIMES, reached, strict=True)}
    return times | chances | {f"steps to {goal}": chain.expected_steps_to(goal) for goal in chain.goals if goal != EXIT}
