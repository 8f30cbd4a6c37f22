"""The goal graphs of the study: every one of up to five rooms, a sample of six and seven, and twins."""

from __future__ import annotations

import numpy as np

from hierroom.complexity import GraphSet
from hierroom.goals import GoalGraph, enumerate_graphs

EVERY_ROOMS = (2, 3, 4, 5)
"""Every goal graph of so many rooms is in the study: 1 + 3 + 9 + 26 = 39, up to isomorphism."""
SAMPLED_ROOMS = (6, 7)
"""Of these a sample: there are 75 and 214."""
TWIN_ROOMS = 4
"""Graphs of so many rooms have a twin."""


def study_graphs(n_sampled: int = 20, seed: int = 0) -> tuple[GoalGraph, ...]:
    """Return the goal graphs of the study, no two of them isomorphic.

    Args:
        n_sampled: how many graphs of six rooms, and how many of seven.
        seed: of the sample.
    """
    rng = np.random.default_rng(seed)
    sampled = []
    for n_rooms in SAMPLED_ROOMS:
        graphs = enumerate_graphs(n_rooms)
        sampled += [graphs[i] for i in sorted(rng.choice(len(graphs), n_sampled, replace=False).tolist())]
    return (*GraphSet(tuple(f"rooms:{n}" for n in EVERY_ROOMS)).graphs, *sampled)


def twins(seed: int = 0) -> dict[str, GoalGraph]:
    """Return copies of goal graphs with other numbers of their rooms, by the name of the graph that each is a copy of.

    To be trained next to it: what a graph and its twin differ by is noise. A graph that no other numbers change has no
    twin.

    Args:
        seed: of the numbers.
    """
    rng = np.random.default_rng(seed)
    found = {}
    for graph in GraphSet(f"rooms:{TWIN_ROOMS}").graphs:
        others = [other for other in _renumbered(graph, rng) if other != graph]
        if others:
            found[graph.name] = others[0]
    return found


def _renumbered(graph: GoalGraph, rng: np.random.Generator, tries: int = 20) -> list[GoalGraph]:
    copies = []
    for _ in range(tries):
        new = np.concatenate([[0], 1 + rng.permutation(graph.n_rooms - 1)])  # [rooms] their new numbers
        key_rooms = np.empty(graph.n_rooms - 1, int)
        key_rooms[new[1:] - 1] = new[list(graph.key_rooms)]
        copies.append(GoalGraph.named(f"keys-{'-'.join(map(str, key_rooms))}-exit-{new[graph.exit_room]}"))
    return copies
