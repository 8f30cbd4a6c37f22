"""Equivalent nodes of an augmented graph: nodes that a renaming of rooms maps onto each other.

A walk from the start reaches equivalent nodes with the same probabilities, so a sum over nodes needs only one node of
each class: a star of ten rooms has 5,121 nodes in 69 classes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.complexity.augmented import AugmentedGraph, Node


def alike_nodes(augmented: AugmentedGraph) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Find one node of each class of equivalent nodes, and the size of each class.

    Two nodes are equivalent if an automorphism of the goal graph (a renaming of rooms that preserves the tree of keys
    and the exit room) maps the room and the open doors of one to those of the other. It then maps the walk to itself.

    Args:
        augmented: the augmented graph, in any reading.

    Returns:
        ([k] int64 node indices, [k] int64 class sizes), in order of first appearance.
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
