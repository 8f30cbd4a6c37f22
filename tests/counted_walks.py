"""Chains counted from trajectories, as a check of chains that are measured from play."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from hierroom.complexity.played.observed import EpisodeCounts, counts_of


def count_transitions(trajectories: Iterable[ArrayLike], n_nodes: int, start: int, exit_node: int) -> EpisodeCounts:
    """Count the transitions of whole episodes, each given as its nodes [length + 1] from the start on.

    An episode escaped if its last node is the exit; else it was truncated there, and one more transition leads back.
    """
    keys, triples, lengths, escaped = [], [], [], []
    for episode, nodes in enumerate(map(np.asarray, trajectories)):
        lengths.append(len(nodes) - 1)
        escaped.append(nodes[-1] == exit_node)
        closed = nodes if escaped[-1] else np.append(nodes, start)
        triples.append((nodes[:-2].astype(np.int64) * n_nodes + nodes[1:-1]) * n_nodes + nodes[2:])
        keys.append((episode * n_nodes + closed[:-1].astype(np.int64)) * n_nodes + closed[1:])
    return counts_of(np.concatenate(keys), n_nodes, np.array(lengths), np.array(escaped), np.concatenate(triples))
