"""Counts of episodes of play, and their mean, deviation and reach without a chain, with intervals over all levels.

- **Reach**: the share of E episodes that escaped within t steps, with Wilson's score interval (Wilson, 1927; Brown,
  Cai and DasGupta, 2001). The interval is about 4 / E wide even if no episode escaped.
- **Times**: percentile intervals of the bootstrap over whole episodes (Efron and Tibshirani, 1993, chapter 13). There
  is none for fewer than `FEWEST_EPISODES`, or if the resamples do not differ.
- **Order**: a test of whether play is Markov on the nodes, or the next node also depends on the previous one. For each
  node j, the counts n_ijk of the sequences i, j, k form a table of predecessors i by successors k. If play is a Markov
  chain of order one, rows and columns are independent. Pearson's statistic of the tables, summed over the nodes j, is
  then chi-squared, with the sum of their degrees of freedom (Anderson and Goodman, Statistical inference about Markov
  chains, 1957, section 3.3). Staying counts as a step. The test cannot find differences between levels, or a longer
  memory that does not show in the last two nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri

from hierroom.complexity.chains.weights import as_times

FEWEST_EPISODES = 10
"""With fewer episodes, no interval is given, because one from resampling would be much too narrow."""


@dataclass(frozen=True, eq=False)
class EpisodeCounts:
    """Counts of the steps from node to node in each episode; staying at a node counts as a step too."""

    n_nodes: int  # number of nodes n
    episodes: NDArray[np.int64]  # [K], the episode of each entry, 0 to ``len(lengths) - 1``
    sources: NDArray[np.int64]  # [K], the node where the step began
    targets: NDArray[np.int64]  # [K], the node where it ended
    counts: NDArray[np.int64]  # [K], number of such steps in the episode
    lengths: NDArray[np.int64]  # [E], number of steps of each episode
    escaped: NDArray[np.bool_]  # [E], whether the episode reached the exit
    triples: NDArray[np.int64]  # [T, 4], three nodes in a row and their count
    failed: NDArray[np.bool_] | None = None  # [E], whether the episode terminated without the exit; None: never

    @classmethod
    def of(
        cls, walks: Sequence[ArrayLike], n_nodes: int, start: int, end: int, failed: ArrayLike | None = None
    ) -> EpisodeCounts:
        """Count the steps of whole episodes, each given as its nodes [length + 1], all from ``start`` on.

        An episode escaped if its last node is ``end``, the exit. Any other returns to the start, in one more step.
        """
        keys, triples, several = [], [], [np.asarray(walk, np.int64) for walk in walks]
        escaped = np.array([nodes[-1] == end for nodes in several])
        for episode, nodes in enumerate(several):
            closed = nodes if escaped[episode] else np.append(nodes, start)
            keys.append((episode * n_nodes + closed[:-1]) * n_nodes + closed[1:])
            triples.append((nodes[:-2] * n_nodes + nodes[1:-1]) * n_nodes + nodes[2:])
        unique, counts = np.unique(np.concatenate(keys), return_counts=True)
        in_a_row, times = np.unique(np.concatenate(triples), return_counts=True)
        return cls(
            n_nodes,
            *_digits(unique, n_nodes),
            counts,
            np.array([len(nodes) - 1 for nodes in several]),
            escaped,
            np.stack([*_digits(in_a_row, n_nodes), times], axis=1),
            None if failed is None else np.asarray(failed, bool) & ~escaped,
        )

    def total(self, multiplicity: ArrayLike | None = None) -> sp.csr_array:
        """Return the sum [n, n] of the transitions; each episode counts ``multiplicity`` [E] times, by default once."""
        times = np.ones(len(self.lengths)) if multiplicity is None else np.asarray(multiplicity, float)
        shape = (self.n_nodes, self.n_nodes)
        return sp.coo_array((self.counts * times[self.episodes], (self.sources, self.targets)), shape=shape).tocsr()

    @property
    def step_limit(self) -> float:
        """Number of steps of the shortest truncated episode; ``inf`` if none was truncated."""
        was_cut = ~self.escaped if self.failed is None else ~(self.escaped | self.failed)
        return float(self.lengths[was_cut].min()) if was_cut.any() else np.inf

    def reach(self, t: ArrayLike) -> NDArray[np.float64]:
        """Return the fraction of the episodes that escaped within t steps; ``nan`` beyond the step limit."""
        steps = as_times(t)
        share = np.searchsorted(np.sort(self.lengths[self.escaped]), steps, side="right") / len(self.lengths)
        return np.where(steps > self.step_limit, np.nan, share)

    def passage(self, multiplicity: ArrayLike | None = None) -> tuple[float, float]:
        """Return mean and standard deviation of the steps T from a start to the next exit; a restart is a step.

        With X the steps of an episode (and its restart) and I whether it escapes, the mean is E[X] / E[I]. T adds up X
        until the first escape, so by Wald's second identity Var T = E[(X - E[T] I)^2] / E[I]. It is estimated with one
        escape fewer in the denominator, as the usual variance is. The order of the episodes does not matter.

        Args:
            multiplicity: [E], how often each episode counts; by default once.

        Returns:
            The two numbers; ``inf`` if no episode escaped, the deviation also if only one did.
        """
        times = np.ones(len(self.lengths), np.int64) if multiplicity is None else np.asarray(multiplicity)
        steps, n_escaped = self.lengths + ~self.escaped, int(times @ self.escaped)
        if n_escaped == 0:
            return float("inf"), float("inf")
        mean = int(times @ steps) / n_escaped
        squares = float(times @ (steps - mean * self.escaped) ** 2)
        return mean, float(np.sqrt(squares / (n_escaped - 1))) if n_escaped > 1 else float("inf")


def _digits(keys: NDArray[np.int64], base: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    rest, last = np.divmod(keys, base)
    first, second = np.divmod(rest, base)
    return first, second, last


class Interval(NamedTuple):
    """A value and its confidence interval; low and high are ``nan`` if there is none."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return "none" if np.isnan(self.low) else f"{self.low:.4g} to {self.high:.4g}"


def wilson_interval(share: float, n: int, level: float) -> Interval:
    """Return Wilson's score interval for a share of successes in n trials."""
    z = float(ndtri((1 + level) / 2))
    middle = (share + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(share * (1 - share) / n + z**2 / (4 * n**2))
    low = float(middle - half) if share > 0 else 0.0  # exactly, where rounding would give 1e-19
    return Interval(share, low, float(middle + half) if share < 1 else 1.0)


def percentile_interval(value: float, resampled: ArrayLike, n_episodes: int, level: float) -> Interval:
    """Return the percentile interval of resampled values; low and high are ``nan`` if it would be misleading."""
    low, high = np.quantile(np.asarray(resampled), ((1 - level) / 2, (1 + level) / 2), method="inverted_cdf")
    if n_episodes < FEWEST_EPISODES or not low < high:
        return Interval(value, np.nan, np.nan)
    return Interval(value, float(low), float(high))


def observed(
    counts: EpisodeCounts, times: tuple[int, ...], level: float, n_resamples: int, rng: np.random.Generator
) -> dict[str, Interval]:
    """Return `"expected_steps"` to the exit, their `"std"` and `"exit within N"`; ``nan`` if not observed."""
    n, n_escaped = len(counts.lengths), int(counts.escaped.sum())
    mean, std = counts.passage()
    # one after the other, because with many episodes all draws together do not fit into memory
    draws = (rng.multinomial(n, np.full(n, 1 / n)) for _ in range(n_resamples))
    means, stds = np.array([counts.passage(drawn) for drawn in draws]).T
    found = {
        "expected_steps": percentile_interval(mean, means, n, level),
        "std": percentile_interval(std if n_escaped > 1 else np.nan, stds, n_escaped, level),
    }
    for t, share in zip(times, counts.reach(times).tolist(), strict=True):
        is_seen = not np.isnan(share)
        found[within(t)] = wilson_interval(share, n, level) if is_seen else Interval(share, np.nan, np.nan)
    return found


def within(t: int) -> str:
    """Return the name of the probability to escape within t steps."""
    return f"exit within {t}"


LEAST_EXPECTED = 5.0
"""Rows and columns with smaller expected counts are pooled (Cochran, 1954), else the statistic is not chi-squared."""
SIGNIFICANCE = 0.01
"""With a smaller p-value, play is reported as not Markov."""


class MarkovTest(NamedTuple):
    """The result of a test of order one against order two."""

    statistic: float  # Pearson's chi-squared, summed over the nodes
    degrees: int  # degrees of freedom
    p_value: float  # probability of a statistic at least as large if play is Markov on the nodes

    @property
    def is_rejected(self) -> bool:
        """Return whether play is not Markov on these nodes, at the level `SIGNIFICANCE`."""
        return self.p_value < SIGNIFICANCE


def markov_test(triples: NDArray[np.int64]) -> MarkovTest | None:
    """Test order one with ``triples`` [T, 4], three nodes in a row and their count; None if the counts are too few."""
    from scipy.stats import chi2, chi2_contingency  # loads slowly, and few programs need it

    statistic, degrees = 0.0, 0
    for node in np.unique(triples[:, 1]):
        here = triples[triples[:, 1] == node]
        predecessors, rows = np.unique(here[:, 0], return_inverse=True)
        successors, columns = np.unique(here[:, 2], return_inverse=True)
        table = np.zeros((len(predecessors), len(successors)))
        table[rows, columns] = here[:, 3]
        table = _pooled(table)
        if min(table.shape) > 1:
            of_node = tuple(chi2_contingency(table, correction=False))  # statistic, p-value, degrees, expected
            statistic, degrees = statistic + float(of_node[0]), degrees + int(of_node[2])
    return MarkovTest(statistic, degrees, float(chi2.sf(statistic, degrees))) if degrees else None


def _pooled(table: NDArray[np.float64]) -> NDArray[np.float64]:
    """Merge the two smallest rows, or columns if there are more of them, until no expected count is too small."""
    while min(table.shape) > 1:
        rows, columns = np.sort(table.sum(axis=1)), np.sort(table.sum(axis=0))
        if rows[0] * columns[0] >= LEAST_EXPECTED * rows.sum():
            break
        is_wide = table.shape[1] > table.shape[0]
        of_rows = table.T if is_wide else table
        order = np.argsort(of_rows.sum(axis=1), kind="stable")
        of_rows = np.vstack([of_rows[order[:2]].sum(axis=0), of_rows[order[2:]]])
        table = of_rows.T if is_wide else of_rows
    return table
