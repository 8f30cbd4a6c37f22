"""A goal graph as a deterministic MDP: its nodes are the states, and an action is a move between them."""

from __future__ import annotations

import numpy as np

from hierroom.complexity.augmented import AugmentedGraph
from hierroom.complexity.measures.mdp import DeterministicMDP


def graph_mdp(augmented: AugmentedGraph) -> DeterministicMDP:
    """The MDP of an agent that chooses the next node of an augmented goal graph.

    Action i takes the i-th edge of a node, in the order of `AugmentedGraph.edges`; a node with fewer edges stays where
    it is, as illegal goals do nothing in an environment. The step to the exit earns 1 and ends the episode. Staying and
    restarts, which the paper's walk adds, are no part of it.

    Args:
        augmented: the augmented graph.
    """
    sources, targets = augmented.edges.T
    n = len(augmented.nodes)
    out_degree = np.bincount(sources, minlength=n)
    transitions = np.repeat(np.arange(n)[:, None], out_degree.max(), axis=1)
    order = np.argsort(sources, kind="stable")
    ranks = np.arange(len(sources)) - (np.cumsum(out_degree) - out_degree)[sources[order]]
    transitions[sources[order], ranks] = targets[order]
    rewards = ((transitions == augmented.exit) & (np.arange(n) != augmented.exit)[:, None]).astype(float)
    return DeterministicMDP(transitions, rewards, augmented.start)
