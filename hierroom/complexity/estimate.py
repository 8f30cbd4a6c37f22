"""Play in real rooms, seen as a walk on the augmented graph.

**Which node is the agent at?** Every state of a room has exactly one:

- the exit, once it is reached;
- (key k, open doors), while the agent holds a key whose door is still locked: k is the room of the last such key it
  picked up, the one that it would drop;
- else (room r, open doors) for the room r it stands in; a doorway belongs to the room behind it.

So a key node lasts from the pick-up until the door is open. Play has other edges than the paper's graph, where a key
leads into the room it opens: opening a door leaves the agent in the centre, before the open door; and with a second
key in hand it is at that key's node at once.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.complexity.augmented import AugmentedGraph
from hierroom.complexity.counts import EpisodeCounts, counts_of
from hierroom.complexity.measured import MeasuredReport
from hierroom.complexity.report import analyze
from hierroom.errors import InputError
from hierroom.goals import GoalGraph
from hierroom.step import Step
from hierroom.turns import Turns
from hierroom.world.oracle import shortest_actions

Player: TypeAlias = Callable[[Turns], Step]
"""Takes one primitive step in every room of the turns, and the meta-controller's turns before it where it has one;
`hierroom.agent.Agent.step` is one."""


Progress: TypeAlias = Callable[[int], object]
"""Called with the number of episodes done."""


def _in_silence(done: int) -> None:
    pass


class NodeMap:
    """Where rooms of one goal graph stand in its augmented graph.

    Args:
        augmented: the augmented graph.
    """

    def __init__(self, augmented: AugmentedGraph) -> None:
        self.exit = augmented.exit
        n_branches = augmented.graph.n_rooms - 1
        self._nodes = np.full((2, n_branches + 1, 1 << n_branches), -1)  # key or room, which, open doors as bits
        for i, node in enumerate(augmented.nodes[:-1]):
            self._nodes[int(node.kind == "room"), node.room, sum(1 << (door - 1) for door in node.doors)] = i

    def __call__(self, rooms: np.ndarray, terminated: NDArray[np.bool_]) -> NDArray[np.int64]:
        """The node of each room.

        Args:
            rooms: [M] records of `layout.ROOM`.
            terminated: [M] bool, whether the exit has been reached.

        Returns:
            [M] int64 indices into the augmented graph's nodes.
        """
        carried = rooms["carried"]
        nodes = self._nodes[
            (carried < 0).astype(int), np.where(carried < 0, _room_of(rooms), carried + 1), rooms["doors"]
        ]
        return np.where(terminated, self.exit, nodes)


def _room_of(rooms: np.ndarray) -> NDArray[np.int64]:
    """[M] the room each agent stands in, a doorway being part of the room behind it."""
    row, col = rooms["row"][:, None], rooms["col"][:, None]
    top, left, bottom, right = np.moveaxis(rooms["rectangles"], -1, 0)
    inside = (top <= row) & (row <= bottom) & (left <= col) & (col <= right)  # [M, rooms]
    inside[:, 1:] |= (rooms["doors_at"] == np.stack([rooms["row"], rooms["col"]], axis=-1)[:, None]).all(axis=-1)
    return inside.argmax(axis=1)


def play(turns: Turns, player: Player, episodes: int, progress: Progress = _in_silence) -> EpisodeCounts:
    """Let a player play the first episodes of each room, and count its moves between nodes.

    Rooms play equally many episodes, so short ones do not count more.

    Args:
        turns: N fresh rooms of one goal graph, which begin their next episode by themselves.
        player: takes the steps.
        episodes: at least so many in all.
        progress: called with the number of episodes done.

    Returns:
        The transitions of each episode.

    Raises:
        InputError: if fewer than one episode is asked for, or the rooms are of several goal graphs.
    """
    if episodes < 1:
        raise InputError(f"play at least one episode, not {episodes}")
    augmented = AugmentedGraph(graph_of(turns))
    node_of, n_nodes, n = NodeMap(augmented), len(augmented.nodes), len(turns)
    per_room = -(-episodes // n)
    lengths, escaped = np.zeros(n * per_room, np.int64), np.zeros(n * per_room, bool)
    played, keys = np.zeros(n, np.int64), []
    nodes = node_of(turns.world.state.rooms, np.zeros(n, bool))
    while (counted := np.flatnonzero(played < per_room)).size:
        step = player(turns)
        rooms = np.where(step.over, turns.world.finals, turns.world.state.rooms)
        after = node_of(rooms, step.terminated)
        episode = counted * per_room + played[counted]
        keys.append((episode * n_nodes + nodes[counted]) * n_nodes + after[counted])
        truncated = counted[step.over[counted] & ~step.terminated[counted]]
        keys.append(
            ((truncated * per_room + played[truncated]) * n_nodes + after[truncated]) * n_nodes + augmented.start
        )
        ended = counted[step.over[counted]]
        lengths[ended * per_room + played[ended]] = step.lengths[ended]
        escaped[ended * per_room + played[ended]] = step.terminated[ended]
        played[ended] += 1
        nodes = np.where(step.over, augmented.start, after)
        if len(ended):
            progress(int(played.sum()))
    return counts_of(np.concatenate(keys), n_nodes, lengths, escaped)


def measure(
    turns: Turns, player: Player, episodes: int = 1000, progress: Progress = _in_silence, seed: int = 0
) -> MeasuredReport:
    """Play in real rooms and report the chain that comes of it, beside the walk that is assumed.

    Args:
        turns: N fresh rooms of one goal graph, which begin their next episode by themselves.
        player: takes the steps: `random_player`, `oracle_player`, `acting`, or an agent's ``step``.
        episodes: at least so many in all.
        progress: called with the number of episodes done.
        seed: fixes the bootstrap.

    Raises:
        InputError: if fewer than one episode is asked for, or the rooms are of several goal graphs.
    """
    counts = play(turns, player, episodes, progress)
    assumed = analyze(graph_of(turns), drop_key=bool(turns.world.state.rooms["can_drop"][0]))
    return MeasuredReport(assumed, counts, seed=seed)


def graph_of(turns: Turns) -> GoalGraph:
    """The goal graph that all rooms of the turns have.

    Raises:
        InputError: if they have several.
    """
    records = turns.world.graph_records
    if len(records) != 1:
        raise InputError(f"a chain is measured in rooms of one goal graph, not of {len(records)}")
    return GoalGraph(tuple(records[0].key_rooms[: records[0].n_rooms - 1]), records[0].exit_room)


def acting(choose: Callable[[Turns], ArrayLike]) -> Player:
    """A player of any policy that gives the controller's actions [N] for the turns."""
    return lambda turns: turns.step(choose(turns))


def random_player(rng: np.random.Generator) -> Player:
    """Every action with the same chance."""
    return acting(lambda turns: rng.integers(turns.world.n_actions, size=len(turns)))


def oracle_player() -> Player:
    """A shortest way to the exit."""
    plans: dict[int, deque[int]] = {}

    def step(turns: Turns) -> Step:
        for room in range(len(turns)):
            if not plans.get(room):
                plans[room] = deque(shortest_actions(turns.world.get_state(room)).tolist())
        taken = turns.step(np.array([plans[room].popleft() for room in range(len(turns))]))
        for room in np.flatnonzero(taken.over).tolist():
            plans[room].clear()
        return taken

    return step
