"""A chain measured from play in EscapeRooms: moves counted between nodes of the augmented graph.

Every state of a level has exactly one node:

- the exit, once it is reached;
- (key k, open doors), while the agent holds a key whose door is still locked: k is the room of the last such key it
  picked up, the one that it would drop;
- else (room r, open doors) for the room r it stands in; a doorway belongs to the room behind it.

W_ij is the fraction of the steps from node i that led to node j. An episode that misses the exit returns from its last
node to the start, in one more step, so the chain's mean is the observed one for every policy. The exit leads back to
the start as in the assumed walk.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from hierroom.agents.player import Play, Player
from hierroom.complexity import AugmentedGraph, Chain, analyze
from hierroom.turns.turns import Turns
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


@dataclass(frozen=True)
class PlayedChain:
    """The chain of some episodes, and the share of them that reached the exit."""

    chain: Chain
    success_rate: float


def measure_play(turns: Turns, player: Player, episodes: int) -> PlayedChain:
    """Let a player play in N new environments of one goal graph, and count its moves."""
    rooms: Any = turns.world
    report = analyze(rooms.rules)
    node_of, n, escaped = NodeMap(report.augmented, rooms.state.maps), report.nodes, 0
    start, end = report.augmented.start, report.augmented.exit
    before, moves = np.full(len(turns), start), np.zeros((n, n), np.int64)
    for step in (play := Play(turns, player, episodes)):
        rooms, counts = play.turns.world, play.counted
        after = node_of(np.where(step.episode_ended, rooms.finals, rooms.state.levels), step.terminated)
        np.add.at(moves, (before[play.envs[counts]], after[counts]), 1)
        moves[:, start] += np.bincount(after[counts][(step.episode_ended & ~step.terminated)[counts]], minlength=n)
        escaped += int(step.terminated[counts].sum())
        before[play.envs] = np.where(step.episode_ended, start, after)
    weights = moves / np.maximum(moves.sum(axis=1, keepdims=True), 1)  # rows of nodes never visited stay zero
    weights[end, start] = report.walk.restart
    return PlayedChain(replace(report.chain, weights=sp.csr_array(weights)), escaped / episodes)
