"""Which nodes of an augmented graph are alike, because renaming rooms turns one into the other.

A walk from the start reaches alike nodes with the same chances, so whatever is summed over nodes needs one of each
kind: a star of ten rooms has 5,121 nodes of 69 kinds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.complexity.augmented import AugmentedGraph, Node


def alike_nodes(augmented: AugmentedGraph) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """One node of each kind, and how many there are of it.

    Two nodes are alike if an automorphism of the goal graph (a renaming of rooms that keeps the tree of keys and the
    exit room) takes the one's room and open doors to the other's. It then takes the walk to itself.

    Args:
        augmented: the augmented graph, under any reading.

    Returns:
        ([k] int64 node indices, [k] int64 numbers of nodes), in order of first appearance.
    """
    children: list[list[int]] = [[] for _ in range(augmented.graph.n_rooms)]
    for room, key_room in enumerate(augmented.graph.key_rooms, start=1):
        children[key_room].append(room)

    def shape(node: Node, room: int) -> tuple:
        below = sorted(shape(node, child) for child in children[room])
        return (room in node.doors, room == node.room, room == augmented.graph.exit_room, *below)

    kinds: dict[tuple, list[int]] = {}
    for i, node in enumerate(augmented.nodes):
        kinds.setdefault((node.kind, shape(node, 0)), []).append(i)
    return np.array([alike[0] for alike in kinds.values()]), np.array([len(alike) for alike in kinds.values()])
