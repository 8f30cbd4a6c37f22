"""The node of a level in the augmented graph of its goal graph.

Every state of a level has exactly one node:

- the exit, once it is reached;
- (key k, open doors), while the agent holds a key whose door is still locked: k is the room of the last such key it
  picked up, the one that it would drop;
- else (room r, open doors) for the room r it stands in; a doorway belongs to the room behind it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.complexity.augmented import AugmentedGraph
from hierroom.worlds.escape_room.layout import Maps
from hierroom.worlds.escape_room.rooms import rooms_of


class NodeMap:
    """Finds the nodes of levels of one goal graph in its augmented graph."""

    def __init__(self, augmented: AugmentedGraph, maps: Maps) -> None:
        self.exit, self._maps = augmented.exit, maps
        n_branches = augmented.graph.n_rooms - 1
        self._nodes = np.full((2, n_branches + 1, 1 << n_branches), -1)  # kind (key, room), number, open doors as bits
        for i, node in enumerate(augmented.nodes[:-1]):
            self._nodes[int(node.kind == "room"), node.room, sum(1 << (door - 1) for door in node.doors)] = i

    def __call__(self, levels: np.ndarray, terminated: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return the node [M] of each level, records of `layout.LEVEL`: an index into the augmented graph's nodes."""
        carried = levels["carried"]
        nodes = self._nodes[
            (carried < 0).astype(int), np.where(carried < 0, self._room_of(levels), carried + 1), levels["doors"]
        ]
        return np.where(terminated, self.exit, nodes)

    def _room_of(self, levels: np.ndarray) -> NDArray[np.int64]:
        is_at_door = (levels["doors_at"] == np.stack([levels["row"], levels["col"]], axis=-1)[:, None]).all(axis=-1)
        return np.where(is_at_door.any(axis=1), is_at_door.argmax(axis=1) + 1, rooms_of(levels, self._maps))
