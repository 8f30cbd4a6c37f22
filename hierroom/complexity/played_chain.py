"""A chain measured from play in any environment, and its numbers next to those of the episodes, with intervals.

In levels of a goal graph, W comes from counted moves between nodes of its augmented graph, next to the assumed walk.
There, two kinds of edges come from the assumed walk. A truncated episode leads back to the start, like the walk's
restart ("the agent is not able to reach the exit within the time limit"). The only edge of the exit is its restart.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from hierroom.complexity.chains.chain import EXIT, Chain
from hierroom.complexity.chains.walk import PAPER_WALK
from hierroom.complexity.chains.weights import row_sums
from hierroom.complexity.observed import (
    EpisodeCounts,
    Interval,
    MarkovTest,
    markov_test,
    observed,
    percentile_interval,
    wilson_interval,
    within,
)
from hierroom.complexity.report import ComplexityReport
from hierroom.complexity.walk_report import REPORT_TIMES, by_time
from hierroom.support.errors import InputError, require_number, shown
from hierroom.support.output import said_in_turn
from hierroom.support.tables import html_table, text_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class MoveDifference(NamedTuple):
    """One edge in the assumed walk and in the measured chain."""

    source: str
    target: str
    assumed: float  # probability per step
    measured: float  # probability per step
    count: int  # number of times in play


@dataclass(frozen=True, eq=False, repr=False)
class PlayedChain:
    """A walk with the same frequencies of moves as the episodes, next to the observed numbers.

    W_ij is the fraction of the steps from node i that led to node j. An episode that misses the exit returns from its
    last node to the source, in one more step. Then the counts balance at every node, so the chain's `expected_steps`
    equal `empirical_steps` for every policy. The exit leads back to the source with probability ``restart``.

    All other numbers, such as a probability within t steps, are true of play only if play is Markov on these nodes: see
    `markov`, and compare with `observed`.

    Examples:
        >>> walks = [["in", "hall", "in", "hall", "out"], ["in", "hall", "out"]]
        >>> played = hierroom.complexity.measure_trajectories(walks, target="out")
        >>> played.episodes, played.success_rate, played.empirical_steps
        (2, 1.0, 3.0)
    """

    counts: EpisodeCounts  # each episode has at least one transition
    labels: tuple[str, ...]  # the name of each node
    source: int  # the node at which every episode begins
    goals: Mapping[str, tuple[int, ...]]  # for each goal the nodes at which it has been achieved; "exit" is one node
    restart: float = PAPER_WALK.restart  # probability to leave the exit for the source in one step
    times: tuple[int, ...] = REPORT_TIMES  # numbers of steps for which the probability to escape is reported
    level: float = 0.95  # confidence level of the intervals, above 0 and below 1
    n_resamples: int = 200  # number of bootstrap resamples of whole episodes, at least 2
    seed: int = 0  # seed of the resamples
    assumed: ComplexityReport | None = None  # the walk whose predictions stand next to what was played

    def __post_init__(self) -> None:
        n = self.counts.n_nodes
        if len(self.labels) != n:
            raise InputError(f"counts over {n} nodes need {n} labels, not {len(self.labels)}")
        if not 0 < self.level < 1 - 1e-15:  # closer to 1, the tails of intervals round to 0
            raise InputError(f"intervals need a level between 0 and 1, not {shown(self.level)}")
        require_number("the number of resamples", self.n_resamples, 2, is_whole=True)
        require_number("seed", self.seed, 0, 2**63 - 1, is_whole=True)

    @classmethod
    def against(cls, assumed: ComplexityReport, counts: EpisodeCounts, **options: Any) -> PlayedChain:
        """Return the chain of counts between the nodes of ``assumed.augmented``; ``options`` are other fields."""
        if counts.n_nodes != assumed.nodes:
            raise InputError(
                f"the counts are over {counts.n_nodes} nodes, but goal graph {assumed.graph.name} has {assumed.nodes}"
            )
        chain, restart = assumed.chain, assumed.walk.restart
        return cls(counts, chain.labels, chain.source, chain.goals, restart, assumed=assumed, **options)

    @cached_property
    def chain(self) -> Chain:
        """The measured walk."""
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
        """Mean number of steps from a start to the next exit, see `EpisodeCounts.passage`."""
        return self.counts.passage()[0]

    def empirical_reach(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the fraction of the episodes that escaped within t steps; ``nan`` beyond the step limit."""
        return self.counts.reach(t)

    @cached_property
    def observed(self) -> dict[str, Interval]:
        """Mean, deviation and reach of the episodes, with intervals; see `observed`."""
        rng = np.random.default_rng([self.seed, 1])
        return observed(self.counts, self.times, self.level, 5 * self.n_resamples, rng)

    @cached_property
    def markov(self) -> MarkovTest | None:
        """The test of whether play is Markov on the nodes; None if the counts do not suffice. See `observed`."""
        return markov_test(self.counts.triples)

    @cached_property
    def intervals(self) -> dict[str, Interval]:
        """The chain's times to the exit and to each goal, and its reach probabilities, with intervals over episodes.

        Episodes are resampled and the numbers computed again (Efron and Tibshirani, 1993, chapter 13). Resamples
        without an escape have infinite times, so an interval may end at ``inf``. If resamples do not differ or episodes
        are few, a time has no interval, and a probability has Wilson's.
        """
        rng = np.random.default_rng(self.seed)
        share = np.full(self.episodes, 1 / self.episodes)
        resamples = [
            summary(self._chain(self.counts.total(rng.multinomial(self.episodes, share))), self.times)
            for _ in said_in_turn("resampling the episodes", range(self.n_resamples))
        ]
        intervals = {}
        for name, value in summary(self.chain, self.times).items():
            intervals[name] = percentile_interval(value, [one[name] for one in resamples], self.episodes, self.level)
            if name.startswith("exit within") and np.isnan(intervals[name].low):
                intervals[name] = wilson_interval(value, self.episodes, self.level)
        return intervals

    @cached_property
    def predictions(self) -> dict[str, float]:
        """The assumed walk's prediction of each quantity in `intervals`; none without one."""
        return summary(self.assumed.chain, self.times) if self.assumed else {}

    def moves(self) -> list[MoveDifference]:
        """Return every edge from a visited node, in the assumed walk or in play, the largest difference first."""
        if self.assumed is None:
            return []
        assumed, measured, counts = self.assumed.chain.weights, self.chain.weights, self.counts.total()
        labels, visited = self.labels, row_sums(counts) > 0
        edges = (assumed + measured).tocoo()
        pairs = [(i, j) for i, j in zip(edges.row.tolist(), edges.col.tolist(), strict=True) if i != j and visited[i]]
        found = (
            MoveDifference(labels[i], labels[j], float(assumed[i, j]), float(measured[i, j]), int(counts[i, j]))
            for i, j in pairs
        )
        return sorted(found, key=lambda move: -abs(move.assumed - move.measured))

    def to_dict(self) -> dict[str, Any]:
        """Return the episodes and their chain as plain numbers, strings, lists and dicts."""
        assumed = {"assumed": self.predictions, "moves": [move._asdict() for move in self.moves()]}
        return {
            **(self.assumed.described() if self.assumed else {}),
            "episodes": self.episodes,
            "nodes": len(self.labels),
            "success_rate": self.success_rate,
            "empirical_steps": self.empirical_steps,
            "level": self.level,
            "observed": {name: interval._asdict() for name, interval in self.observed.items()},
            "markov_test": None if self.markov is None else self.markov._asdict(),
            "measured": {name: interval._asdict() for name, interval in self.intervals.items()},
            "empirical_reach": by_time(self.empirical_reach, self.times),
            "expected_states": by_time(self.chain.expected_states, self.times),
            "goal_sensitivity": self.chain.goal_sensitivity(),
            **(assumed if self.assumed else {}),
        }

    @property
    def columns(self) -> tuple[str, ...]:
        """The headings of `rows`."""
        interval = f"{100 * self.level:g}% interval"
        return "", *(["assumed walk"] if self.assumed else []), "observed", interval, "their chain", interval

    def rows(self) -> list[tuple[str, ...]]:
        """Return a row for each quantity: its name, any prediction, the observed and the chain's value."""
        rows = []
        for name, measured in self.intervals.items():
            seen = self.observed.get(name)
            cells = "", ""
            if seen is not None:
                cells = ("-", "") if np.isnan(seen.value) else (f"{seen.value:.4g}", str(seen))
            predicted = [f"{self.predictions[name]:.4g}"] if self.assumed else []
            rows.append((name, *predicted, *cells, f"{measured.value:.4g}", str(measured)))
        return rows

    def notes(self) -> list[str]:
        """Return lines that explain `rows`, with at most one sentence each."""
        notes = self._test_notes()
        if self.assumed:
            unforeseen = sum(move.count for move in self.moves() if move.assumed == 0)
            notes.insert(
                0, f"{unforeseen} of {self.counts.counts.sum()} steps took an edge that the assumed walk lacks"
            )
        if not self.counts.escaped.any():
            notes.append("nobody escaped, so the times to the exit are infinite")
        missing = {name for name, interval in self.observed.items() if np.isnan(interval.value)}
        if "std" in missing:
            notes.append("-: no deviation was observed, as fewer than two episodes escaped")
        if missing - {"std"}:
            notes.append(f"-: not observed, as episodes were truncated after {self.counts.step_limit:.0f} steps")
        shown = [*self.intervals.values(), *self.observed.values()]
        if any(np.isnan(interval.low) and np.isfinite(interval.value) for interval in shown):
            notes.append("none: the episodes are too few, or too much alike, for an interval")
        if any(np.isinf(interval.value) for interval in self.intervals.values()):
            notes.append("inf: no episode got there")
        return notes

    def _test_notes(self) -> list[str]:
        if self.markov is None:
            return ["too few steps to test whether play is Markov on these nodes: trust what was observed"]
        test = f"Markov of order 1 against 2: chi2({self.markov.degrees}) = {self.markov.statistic:.1f}"
        if not self.markov.is_rejected:
            covers = "each interval covers the value over very many episodes of this player"
            return [f"{test}, p = {self.markov.p_value:.2g}: nothing speaks against the chain", covers]
        return [
            f"{test}, p = {self.markov.p_value:.1g}: play is NOT Markov on these nodes. The chain's expected steps",
            "are those of play all the same; its other numbers and intervals are not: read what was observed instead",
        ]

    @property
    def _head(self) -> str:
        played = f"{self.episodes} episode{'s' * (self.episodes > 1)} played"
        if self.assumed:
            return f"goal graph {self.assumed.graph.name}, {played}, {self.success_rate:.1%} escaped"
        exit_label = self.labels[self.goals[EXIT][0]]
        return f"{played} over {len(self.labels)} nodes, {self.success_rate:.1%} reached the exit, {exit_label!r}"

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._head}>"

    def __str__(self) -> str:
        return text_table(self._head, self.columns, self.rows(), self.notes())

    def _repr_html_(self) -> str:
        return html_table(self._head, self.columns, self.rows(), self.notes())

    def draw(self, path: str | Path) -> None:
        """Draw the reach curves of the episodes, with Wilson's interval, and of the chains, into a file."""
        from hierroom.support.sheet import save_figure  # matplotlib loads slowly, and few chains are drawn

        save_figure(self._figure(), path)

    def _figure(self) -> Figure:
        from matplotlib.figure import Figure

        figure, n = Figure(figsize=(6, 4), layout="constrained"), self.episodes
        axes, times = figure.subplots(), np.unique(np.linspace(0, self.counts.lengths.max(), 200).astype(int))
        shares = self.empirical_reach(times)
        seen = ~np.isnan(shares)  # up to the step limit
        low, high = np.transpose([wilson_interval(share, n, self.level)[1:] for share in shares[seen]])
        axes.fill_between(times[seen], low, high, alpha=0.25, linewidth=0)
        axes.plot(times[seen], shares[seen], label=f"{n} episodes, {100 * self.level:g}% interval")
        axes.plot(times, self.chain.reach_probability(times), "--", label="their chain")
        if self.assumed is not None:
            axes.plot(times, self.assumed.chain.reach_probability(times), "--", label="assumed walk")
            axes.set_title(f"goal graph {self.assumed.graph.name}", parse_math=False)
        axes.set(xlabel="steps", ylabel="probability of exit", ylim=(-0.02, 1.02))  # a curve at zero can be seen
        axes.legend(frameon=False)
        return figure

    def _chain(self, counts: sp.csr_array) -> Chain:
        steps, end = row_sums(counts), self.goals[EXIT][0]
        from_exit = sp.coo_array(([self.restart], ([end], [self.source])), shape=counts.shape)
        shares = counts.multiply(1 / np.maximum(steps, 1)[:, None])  # rows of nodes never visited stay zero
        return Chain((shares + from_exit).tocsr(), self.labels, self.source, self.goals)


def summary(chain: Chain, times: tuple[int, ...]) -> dict[str, float]:
    """Return the reported numbers of a chain: its times, its reach within ``times``, and mean steps to each goal."""
    reached = chain.reach_probability(times)
    found = {"hitting_time": chain.hitting_time, "expected_steps": chain.expected_steps, "std": chain.std}
    chances = {within(t): float(chance) for t, chance in zip(times, reached, strict=True)}
    return found | chances | {f"steps to {goal}": chain.expected_steps_to(goal) for goal in chain.goals if goal != EXIT}
