"""Measure a chain from play: real episodes, seen as a walk on the augmented graph.

**Which node is the agent at?** Every state of a level has exactly one:

- the exit, once it is reached;
- (key k, open doors), while the agent holds a key whose door is still locked: k is the room of the last such key it
  picked up, the one that it would drop;
- else (room r, open doors) for the room r it stands in; a doorway belongs to the room behind it.

So a key node lasts from the pick-up until the door is open. Play has other edges than the paper's graph, where a key
leads into the room it opens: opening a door leaves the agent in the centre, before the open door; and with a second
key in hand it is at that key's node at once.

It stands outside `hierroom.complexity`, which knows of no world and no learner.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import Progress

from hierroom.agents.player import Player, make_player, play, quotas
from hierroom.complexity.augmented import AugmentedGraph
from hierroom.complexity.played.episodes import EpisodeCounts, counts_of
from hierroom.complexity.played.measured import MeasuredReport
from hierroom.complexity.report import analyze
from hierroom.complexity.walk import PAPER_WALK, TABLE_READING, Reading, Walk
from hierroom.goals import GoalGraph, GraphSpec
from hierroom.runs.trained_agent import load
from hierroom.support.errors import InputError, require_number
from hierroom.turns.env_config import EnvConfig
from hierroom.turns.turns import Turns

MAX_ENVS = 100
"""Environments played in side by side, at most."""


class NodeMap:
    """Where levels of one goal graph stand in its augmented graph.

    Args:
        augmented: the augmented graph.
    """

    def __init__(self, augmented: AugmentedGraph) -> None:
        self.exit = augmented.exit
        n_branches = augmented.graph.n_rooms - 1
        self._nodes = np.full((2, n_branches + 1, 1 << n_branches), -1)  # key or room, which, open doors as bits
        for i, node in enumerate(augmented.nodes[:-1]):
            self._nodes[int(node.kind == "room"), node.room, sum(1 << (door - 1) for door in node.doors)] = i

    def __call__(self, levels: np.ndarray, terminated: NDArray[np.bool_]) -> NDArray[np.int64]:
        """The node of each level.

        Args:
            levels: [M] records of `layout.LEVEL`.
            terminated: [M] bool, whether the exit has been reached.

        Returns:
            [M] int64 indices into the augmented graph's nodes.
        """
        carried = levels["carried"]
        nodes = self._nodes[
            (carried < 0).astype(int), np.where(carried < 0, _room_of(levels), carried + 1), levels["doors"]
        ]
        return np.where(terminated, self.exit, nodes)


def count_transitions(
    turns: Turns, player: Player, episodes: int, progress: Callable[[int], object] = lambda done: None
) -> EpisodeCounts:
    """Let a player play the first episodes of each environment, and count its moves between nodes.

    Args:
        turns: N fresh environments of one goal graph, which begin their next episode by themselves.
        player: who plays.
        episodes: how many in all.
        progress: called with the number of episodes done.

    Returns:
        The transitions of each episode.
    """
    augmented = AugmentedGraph(graph_of(turns))
    node_of, n_nodes, n = NodeMap(augmented), len(augmented.nodes), len(turns)
    quota = quotas(episodes, n)
    first = np.cumsum(quota) - quota
    lengths, escaped = np.zeros(episodes, np.int64), np.zeros(episodes, bool)
    nodes, keys, triples = node_of(turns.world.state.levels, np.zeros(n, bool)), [], []
    before = np.full(n, -1)  # the node before the present one, in the same episode
    for played in play(turns, player, episodes, progress):
        step, envs, world, counted, ended = played.step, played.envs, played.turns.world, played.counted, played.ended
        levels = np.where(step.episode_ended, world.finals, world.state.levels)
        last, at, after = before[envs], nodes[envs], node_of(levels, step.terminated)
        episode = first[envs] + played.played
        keys.append((episode[counted] * n_nodes + at[counted]) * n_nodes + after[counted])
        remembered = counted[last[counted] >= 0]
        triples.append((last[remembered] * n_nodes + at[remembered]) * n_nodes + after[remembered])
        truncated = ended[~step.terminated[ended]]
        keys.append((episode[truncated] * n_nodes + after[truncated]) * n_nodes + augmented.start)
        lengths[episode[ended]], escaped[episode[ended]] = step.lengths[ended], step.terminated[ended]
        before[envs] = np.where(step.episode_ended, -1, at)
        nodes[envs] = np.where(step.episode_ended, augmented.start, after)
    return counts_of(np.concatenate(keys), n_nodes, lengths, escaped, np.concatenate(triples))


def measure(
    turns: Turns,
    player: Player,
    episodes: int = 1000,
    progress: Callable[[int], object] = lambda done: None,
    seed: int = 0,
    walk: Walk = PAPER_WALK,
    reading: Reading = TABLE_READING,
) -> MeasuredReport:
    """Play in real levels and report the chain that comes of it, beside the walk that is assumed.

    Args:
        turns: N fresh environments of one goal graph, which begin their next episode by themselves.
        player: who plays: what `make_player` gives, a trained `Pair`, or anything with their method ``step``.
        episodes: how many in all.
        progress: called with the number of episodes done.
        seed: fixes the bootstrap.
        walk: the walk that is assumed.
        reading: interpretation of the paper's augmented graph.
    """
    counts = count_transitions(turns, player, episodes, progress)
    assumed = analyze(graph_of(turns), bool(turns.world.state.levels["can_drop"][0]), walk, reading)
    return MeasuredReport(assumed, counts, seed=seed)


def measure_named(
    name: str,
    graph: GraphSpec | None,
    drop_key: bool,
    episodes: int,
    seed: int,
    size: int | None = None,
    max_steps: int | None = None,
    walk: Walk = PAPER_WALK,
    reading: Reading = TABLE_READING,
    trust: bool = False,
) -> MeasuredReport:
    """Measure the player that the command line names, with a progress bar.

    Args:
        name: `"random"`, `"oracle"`, or the folder of a training run, whose settings the environments then have.
        graph: a goal graph as users name it; None for the run's, and for `"random"` and `"oracle"` graph c.
        drop_key: whether keys can be dropped; a run that trained so has it on anyway.
        episodes: how many.
        seed: fixes the levels, the actions and the bootstrap.
        size: cells of the grid's side; None: the run's, and for `"random"` and `"oracle"` the default.
        max_steps: primitive steps after which an episode is truncated; None likewise.
        walk: the walk that is assumed, to compare with.
        reading: interpretation of the paper's augmented graph, likewise.
        trust: whether to run the code that the run's config names, as for `load`.
    """
    require_number("episodes", episodes, 1, 10**9, is_whole=True)
    num_envs = min(MAX_ENVS, episodes)
    given = {"graph": graph, "size": size, "max_steps": max_steps}
    entries: dict[str, Any] = {entry: value for entry, value in given.items() if value is not None}
    if name in ("random", "oracle"):
        turns = Turns(EnvConfig(drop_key=drop_key, levels="evaluation", **entries), num_envs, seed=seed)
        player: Player = make_player(name, seed)
    else:
        turns, player = _trained(name, entries, drop_key, num_envs, seed, trust)
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:  # in a file: an empty line
        task = bar.add_task("playing", total=episodes)
        return measure(turns, player, episodes, lambda done: bar.update(task, completed=done), seed, walk, reading)


def graph_of(turns: Turns) -> GoalGraph:
    """The goal graph that all levels of the turns have."""
    graph, *others = turns.sampler.everything
    if others:
        raise InputError(f"a chain is measured in environments of one goal graph, not of {1 + len(others)}")
    return graph


def _trained(
    name: str, entries: dict[str, Any], drop_key: bool, num_envs: int, seed: int, trust: bool
) -> tuple[Turns, Player]:
    agent = load(name, trust=trust)
    turns = agent.turns(num_envs, seed=seed, env=agent.env(**entries))
    if drop_key and not turns.world.state.levels["can_drop"][0]:
        raise InputError(f"the agent of {name} was trained without drop, so it cannot play with --drop")
    n_graphs = len(turns.sampler.everything)
    if n_graphs > 1:
        raise InputError(f"the agent of {name} was trained on {n_graphs} goal graphs; name one by --graph")
    return turns, agent.pair(num_envs, seed=seed)


def _room_of(levels: np.ndarray) -> NDArray[np.int64]:
    """[M] the room each agent stands in, a doorway being part of the room behind it."""
    row, col = levels["row"][:, None], levels["col"][:, None]
    top, left, bottom, right = np.moveaxis(levels["rectangles"], -1, 0)
    inside = (top <= row) & (row <= bottom) & (left <= col) & (col <= right)  # [M, rooms]
    inside[:, 1:] |= (levels["doors_at"] == np.stack([levels["row"], levels["col"]], axis=-1)[:, None]).all(axis=-1)
    return inside.argmax(axis=1)
