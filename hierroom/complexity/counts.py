"""Counts of the transitions between nodes in each episode."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray


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
