"""Monte Carlo walks, to check the exact equations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.complexity.chains.weights import Targets, Weights, as_moves, as_node, as_targets, n_nodes, row_sums


def simulate_passage_times(
    weights: Weights, source: int, targets: Targets, n_walks: int, rng: np.random.Generator
) -> NDArray[np.int64]:
    """First-passage times [n_walks] of independent walks that surely reach a target, in steps.

    The time spent at a node before leaving it is one draw, geometric with mean 1 / (chance to leave), so the cost
    follows the number of moves and not the number of steps.
    """
    moves = as_moves(weights)
    n = n_nodes(moves)
    is_target, leave = as_targets(targets, n), np.minimum(row_sums(moves), 1.0)
    # one sorted array for all nodes: row i's cumulative chances, shifted to lie in (i, i + 1]
    owner = np.repeat(np.arange(n), np.diff(moves.indptr))
    within = np.cumsum(moves.data) - np.concatenate([[0.0], np.cumsum(moves.data)])[moves.indptr[owner]]
    thresholds = owner + np.minimum(within / np.where(leave > 0, leave, 1.0)[owner], 1.0)

    at, clock, walking = np.full(n_walks, as_node(source, n)), np.zeros(n_walks, np.int64), np.arange(n_walks)
    while (walking := walking[~is_target[at[walking]]]).size:
        here = at[walking]
        clock[walking] += rng.geometric(leave[here])
        edge = np.searchsorted(thresholds, here + rng.random(walking.size), side="right")
        at[walking] = moves.indices[np.minimum(edge, moves.indptr[here + 1] - 1)]
    return clock
