"""Transitions between nodes, counted episode by episode."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from hierroom.errors import InputError


@dataclass(frozen=True, eq=False)
class EpisodeCounts:
    """How often each episode went from one node to another; staying at a node counts too.

    Args:
        n_nodes: number of nodes n.
        episodes: [K] int64, the episode of each entry, 0 to ``len(lengths) - 1``.
        sources: [K] int64, the node a step began at.
        targets: [K] int64, the node it led to.
        counts: [K] int64, how many such steps the episode has.
        lengths: [E] int64, steps of each episode.
        escaped: [E] bool, whether it reached the exit.
    """

    n_nodes: int
    episodes: NDArray[np.int64]
    sources: NDArray[np.int64]
    targets: NDArray[np.int64]
    counts: NDArray[np.int64]
    lengths: NDArray[np.int64]
    escaped: NDArray[np.bool_]

    def total(self, multiplicity: ArrayLike | None = None) -> sp.csr_array:
        """Transitions summed over the episodes.

        Args:
            multiplicity: [E] how often each episode counts; once by default.

        Returns:
            [n, n] float64 CSR.
        """
        times = np.ones(len(self.lengths)) if multiplicity is None else np.asarray(multiplicity, float)
        shape = (self.n_nodes, self.n_nodes)
        return sp.coo_array((self.counts * times[self.episodes], (self.sources, self.targets)), shape=shape).tocsr()


def count_transitions(trajectories: Iterable[ArrayLike], n_nodes: int, start: int, exit_node: int) -> EpisodeCounts:
    """Count the transitions of whole episodes.

    Args:
        trajectories: for each episode its nodes [length + 1], from the start on; it escaped if the last is the exit,
            and else was truncated there, which counts as one more transition, back to the start.
        n_nodes: number of nodes.
        start: the node every episode begins at.
        exit_node: the node that ends an episode.

    Returns:
        The counts of each episode.

    Raises:
        InputError: if there is no episode, one does not begin at the start or passes the exit, or a node is unknown.
    """
    keys, lengths, escaped = [], [], []
    for episode, trajectory in enumerate(trajectories):
        nodes = np.asarray(trajectory)
        if nodes.ndim != 1 or len(nodes) < 2 or nodes.dtype.kind not in "iu":
            raise InputError(f"episode {episode} must be a row of at least two nodes, not {trajectory!r}")
        if nodes.min() < 0 or nodes.max() >= n_nodes:
            raise InputError(f"nodes are 0 to {n_nodes - 1}; episode {episode} holds {nodes.min()} to {nodes.max()}")
        if nodes[0] != start or (nodes[:-1] == exit_node).any():
            raise InputError(f"episode {episode} must begin at node {start} and may be at the exit only at its end")
        lengths.append(len(nodes) - 1)
        escaped.append(nodes[-1] == exit_node)
        closed = nodes if escaped[-1] else np.append(nodes, start)
        keys.append((episode * n_nodes + closed[:-1].astype(np.int64)) * n_nodes + closed[1:])
    if not keys:
        raise InputError("a chain cannot be measured from no episodes at all")
    return counts_of(np.concatenate(keys), n_nodes, np.array(lengths), np.array(escaped))


def counts_of(
    keys: NDArray[np.int64], n_nodes: int, lengths: NDArray[np.int64], escaped: NDArray[np.bool_]
) -> EpisodeCounts:
    """Gather transitions, each given as one number ``(episode * n + source) * n + target``."""
    unique, counts = np.unique(keys, return_counts=True)
    rest, targets = np.divmod(unique, n_nodes)
    episodes, sources = np.divmod(rest, n_nodes)
    return EpisodeCounts(n_nodes, episodes, sources, targets, counts, lengths, escaped)
