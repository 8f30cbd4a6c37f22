"""Episodes of play as counts: the transitions of each between nodes, and what is seen of them without any chain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from hierroom.complexity.chains.weights import as_times


@dataclass(frozen=True, eq=False)
class EpisodeCounts:
    """How often each episode moved from one node to another; staying at a node counts as a transition too."""

    n_nodes: int  # number of nodes n
    episodes: NDArray[np.int64]  # [K], the episode of each entry, 0 to ``len(lengths) - 1``
    sources: NDArray[np.int64]  # [K], the node where the step began
    targets: NDArray[np.int64]  # [K], the node where it ended
    counts: NDArray[np.int64]  # [K], number of such steps in the episode
    lengths: NDArray[np.int64]  # [E], number of steps of each episode
    escaped: NDArray[np.bool_]  # [E], whether the episode reached the exit
    triples: NDArray[np.int64] | None = None  # [T, 4], three nodes in a row and how often they came; None: not counted
    failed: NDArray[np.bool_] | None = None  # [E], whether the episode ended for good without the exit; None: never

    def total(self, multiplicity: ArrayLike | None = None) -> sp.csr_array:
        """Sum the transitions [n, n] over the episodes, of which each counts ``multiplicity`` [E] times, or once."""
        times = np.ones(len(self.lengths)) if multiplicity is None else np.asarray(multiplicity, float)
        shape = (self.n_nodes, self.n_nodes)
        return sp.coo_array((self.counts * times[self.episodes], (self.sources, self.targets)), shape=shape).tocsr()

    @property
    def step_limit(self) -> float:
        """The number of steps at which the first episode was truncated; ``inf`` if none was."""
        was_cut = ~self.escaped if self.failed is None else ~(self.escaped | self.failed)
        return float(self.lengths[was_cut].min()) if was_cut.any() else np.inf

    def reach(self, t: ArrayLike) -> NDArray[np.float64]:
        """Fraction of the episodes that had escaped within t steps; ``nan`` past the step limit, where nobody knows."""
        steps = as_times(t)
        share = np.searchsorted(np.sort(self.lengths[self.escaped]), steps, side="right") / len(self.lengths)
        return np.where(steps > self.step_limit, np.nan, share)

    def passages(self) -> NDArray[np.int64]:
        """Steps from a start to the next exit over consecutive episodes, [number of episodes that escaped].

        An episode that did not escape adds its steps, and one for the restart.
        """
        ends = np.cumsum(self.lengths + ~self.escaped)[self.escaped]
        return np.diff(ends, prepend=0)


def counts_of(
    keys: NDArray[np.int64],
    n_nodes: int,
    lengths: NDArray[np.int64],
    escaped: NDArray[np.bool_],
    triple_keys: NDArray[np.int64] | None = None,
    failed: NDArray[np.bool_] | None = None,
) -> EpisodeCounts:
    """Count transitions that are encoded as one number each.

    ``keys`` are ``(episode * n + source) * n + target``, and ``triple_keys`` ``(first * n + second) * n + third``.
    """
    unique, counts = np.unique(keys, return_counts=True)
    episodes, sources, targets = _digits(unique, n_nodes)
    triples = None
    if triple_keys is not None:
        unique, times = np.unique(triple_keys, return_counts=True)
        triples = np.stack([*_digits(unique, n_nodes), times], axis=1)
    return EpisodeCounts(n_nodes, episodes, sources, targets, counts, lengths, escaped, triples, failed)


def _digits(keys: NDArray[np.int64], base: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    rest, last = np.divmod(keys, base)
    first, second = np.divmod(rest, base)
    return first, second, last
