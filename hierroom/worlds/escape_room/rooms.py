"""The room of a cell, and the node of a level in the augmented graph of its goal graph.

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
from hierroom.support.kernel import Compiled, njit
from hierroom.worlds.escape_room.layout import LEVEL, NO_MAPS, Maps


@njit(cache=True)
def room_at(level, rooms, row, col):
    """Return the room that contains a cell, or -1 for a doorway; ``rooms`` are those of `Maps`."""
    if level.map:
        return np.int64(rooms[level.map - 1, row, col])
    for r in range(level.n_rooms):
        top, left, bottom, right = level.rectangles[r]
        if top <= row <= bottom and left <= col <= right:
            return r
    return -1


@njit(cache=True)
def find_rooms(levels, rooms):
    """Return the room [M] of each level's agent: see `rooms_of`."""
    found = np.empty(levels.shape[0], np.int64)
    for m in range(levels.shape[0]):
        found[m] = room_at(levels[m], rooms, levels[m].row, levels[m].col)
    return found


def rooms_of(levels: np.ndarray, maps: Maps) -> NDArray[np.int64]:
    """Return the room [M] that each agent stands in, or -1 in a doorway."""
    return _FIND.run(np.ascontiguousarray(levels), maps.rooms)


_FIND = Compiled(find_rooms, np.zeros(1, LEVEL), NO_MAPS.rooms)


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
