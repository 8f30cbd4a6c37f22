"""The augmented goal graph (paper, appendix A): a goal graph unrolled over the sets of open doors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from hierroom.complexity.chains.walk import PAPER_WALK, Walk
from hierroom.goals import GoalGraph
from hierroom.support.errors import InputError

MAX_NODES = 100_000
"""Largest number of nodes of an augmented graph; each room can double the number."""


class Node(NamedTuple):
    """A node of the augmented graph.

    Examples:
        >>> hierroom.complexity.Node("key", room=2, doors=(1,)).label
        'key 2, open 1'
    """

    kind: str  # `"room"`, `"key"` or `"exit"`
    room: int  # the room where the agent is, the room that the key opens, or the room of the exit
    doors: tuple[int, ...]  # rooms with open doors, ascending; empty for the exit, which is a single node

    @property
    def label(self) -> str:
        """A readable name such as ``"key 2, open 1"``; it is unique in a graph and differs from the names of goals."""
        if self.kind == "exit":
            return "exit"
        place = "start" if (self.kind, self.room) == ("room", 0) else f"{self.kind} {self.room}"
        if self.doors:
            return f"{place}, open {' '.join(map(str, self.doors))}"
        return place if place == "start" else f"{place}, all closed"


@dataclass(frozen=True)
class AugmentedGraph:
    """A goal graph unrolled over the sets of open doors, and the random walk on it.

    Args:
        graph: the goal graph.
        drop_key: whether a key can be dropped, which adds moves back from key nodes.
        walk: the probabilities of one step.

    Examples:
        >>> augmented = hierroom.complexity.AugmentedGraph(hierroom.GoalGraph.named("a"))
        >>> augmented.labels
        ('start', 'key 1, all closed', 'start, open 1', 'room 1, open 1', 'exit')
    """

    graph: GoalGraph
    drop_key: bool = False
    walk: Walk = PAPER_WALK

    def __post_init__(self) -> None:
        n_nodes = count_nodes(self.graph)
        if n_nodes > MAX_NODES:
            found = f"{n_nodes:,}" if n_nodes < 10**15 else "far more"
            raise InputError(
                f"the augmented graph may have at most {MAX_NODES:,} nodes; "
                f"this goal graph of {self.graph.n_rooms} rooms gives {found}"
            )

    @cached_property
    def levels(self) -> tuple[tuple[int, ...], ...]:
        """Every set of doors that can be open together, the smallest first; they are not the levels of a world."""
        found, frontier = [()], [()]
        while frontier:
            grown = {tuple(sorted((*doors, key))) for doors in frontier for key in self.keys_in_reach(doors)}
            frontier = sorted(grown)
            found += frontier
        return tuple(found)

    @cached_property
    def nodes(self) -> tuple[Node, ...]:
        """The nodes, ordered by set of open doors, rooms before keys. The start is the first, the exit the last."""
        unrolled = []
        for doors in self.levels:
            unrolled += [Node("room", room, doors) for room in (0, *doors)]
            unrolled += [Node("key", room, doors) for room in self.keys_in_reach(doors)]
        return (*unrolled, Node("exit", self.graph.exit_room, ()))

    @cached_property
    def index(self) -> dict[Node, int]:
        """The position of each node in `nodes`."""
        return {node: i for i, node in enumerate(self.nodes)}

    @property
    def start(self) -> int:
        """Index of the start node, the centre room with all doors closed."""
        return 0

    @property
    def exit(self) -> int:
        """Index of the exit node."""
        return len(self.nodes) - 1

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """The label of each node."""
        return tuple(node.label for node in self.nodes)

    @cached_property
    def edges(self) -> NDArray[np.int64]:
        """The moves (from, to) between nodes without restarts: [n_edges, 2]."""
        pairs = [(i, self.index[after]) for i, node in enumerate(self.nodes) for after in self._moves(node)]
        return np.array(pairs, np.int64)

    @cached_property
    def weights(self) -> sp.csr_array:
        """W [n, n] CSR: 0.19 divided evenly among a node's edges, and 0.01 for the restart (paper, appendix A)."""
        return self.walk.weights(self.edges, len(self.nodes), self.start)

    @cached_property
    def goals(self) -> dict[str, tuple[int, ...]]:
        """Nodes at which each goal has been achieved: ``"key r"`` picked up, ``"door r"`` open, ``"exit"`` reached."""
        rooms = range(1, self.graph.n_rooms)
        achieved = {f"{what} {room}": [] for what in ("key", "door") for room in rooms}
        for i, node in enumerate(self.nodes[:-1]):
            if node.kind == "key":
                achieved[f"key {node.room}"].append(i)
            for room in node.doors:
                achieved[f"door {room}"].append(i)
        return {goal: tuple(indices) for goal, indices in achieved.items()} | {"exit": (self.exit,)}

    def keys_in_reach(self, doors: tuple[int, ...]) -> list[int]:
        """List the closed rooms that have their key in an accessible room when ``doors`` are open."""
        accessible = {0, *doors}
        return [
            room
            for room, key_room in enumerate(self.graph.key_rooms, start=1)
            if room not in accessible and key_room in accessible
        ]

    def _moves(self, node: Node) -> Iterator[Node]:
        """Yield the nodes after one.

        From a room all open rooms and all keys in them are one move away. The appendix draws less; this gives Table 2.
        """
        here, others = ("room", node.room), (0, *node.doors)
        rooms = (Node("room", room, node.doors) for room in others if (node.kind, room) != here)
        if node.kind == "room":
            yield from rooms
            yield from (Node("key", key, node.doors) for key in self.keys_in_reach(node.doors))
            if node.room == self.graph.exit_room:
                yield Node("exit", node.room, ())
        elif node.kind == "key":
            yield Node("room", node.room, tuple(sorted((*node.doors, node.room))))
            if self.drop_key:
                yield from rooms


def count_nodes(graph: GoalGraph) -> int:
    """Count the nodes of the augmented graph without building it.

    A set of open doors is a subtree of the tree of keys that contains room 0. The number of subtrees with root r is
    c(r) = prod over its children of (1 + c(child)). The product rule gives the sum over these subtrees of their rooms
    (one room node each) and of the children just outside them (one key node each). The exit is one more node.

    Examples:
        >>> hierroom.complexity.count_nodes(hierroom.GoalGraph.named("g"))
        14
    """
    subtrees = [(1, 1)] * graph.n_rooms  # their number, and the nodes they give
    for room in np.argsort(graph.depths)[::-1]:
        count, inside_and_fringe = 1, 1
        for child in graph.children[room]:
            with_child, its_nodes = subtrees[child]
            # without the child: one more key node on the fringe; with it: also the nodes of the child's subtree
            inside_and_fringe = inside_and_fringe * (1 + with_child) + count * (1 + its_nodes)
            count *= 1 + with_child
        subtrees[room] = count, inside_and_fringe
    return subtrees[0][1] + 1


def alike_nodes(augmented: AugmentedGraph) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return a node of each class that symmetries exchange [k], and the sizes of the classes, for sums over nodes."""
    graph = augmented.graph

    def shape(node: Node, room: int) -> tuple:
        below = sorted(shape(node, child) for child in graph.children[room])
        return (room in node.doors, room == node.room, room == graph.exit_room, *below)

    kinds: dict[tuple, list[int]] = {}
    for i, node in enumerate(augmented.nodes):
        kinds.setdefault((node.kind, shape(node, 0)), []).append(i)
    return np.array([alike[0] for alike in kinds.values()]), np.array([len(alike) for alike in kinds.values()])
