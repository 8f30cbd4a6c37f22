"""Measure a Markov chain from play: real episodes, seen as a walk on the augmented graph.

Play has other edges than the paper's graph: after opening a door, the agent is in the centre, in front of the door.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np

from hierroom.agents.episode_facts import EpisodeFacts
from hierroom.agents.player import Play, Player, make_player, quotas
from hierroom.complexity.augmented import AugmentedGraph
from hierroom.complexity.chains.walk import PAPER_WALK, Walk
from hierroom.complexity.observed import EpisodeCounts
from hierroom.complexity.play_rules import PlayedRules
from hierroom.complexity.played_chain import PlayedChain
from hierroom.complexity.report import analyze
from hierroom.goals import GoalGraph
from hierroom.runs.trained_agent import load
from hierroom.support.cli import progress_bar
from hierroom.support.errors import InputError, require_number
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig

T = TypeVar("T")
MAX_ENVS = 100  # played in parallel


def count_transitions(
    turns: Turns, player: Player, episodes: int, progress: Callable[[int], object] = lambda done: None
) -> EpisodeCounts:
    """Let a player play the first episodes of each environment, and count its moves between nodes; see `measure`."""
    augmented = AugmentedGraph(graph_of(turns))
    node_of, quota = turns.world.node_map(augmented), quotas(episodes, len(turns))
    first, play = np.cumsum(quota) - quota, Play(turns, player, episodes, progress)
    moved = []  # for each step, the episodes that count [C] and their nodes after it [C]
    for step in play:
        after = play.turns.world.nodes(node_of, terminated=step.terminated, ended=step.episode_ended)
        envs = play.envs[play.counted]
        moved.append(np.stack([first[envs] + play.played[envs], after[play.counted]]))
    numbers, nodes = np.concatenate(moved, axis=1)
    in_order, lengths = np.argsort(numbers, kind="stable"), np.bincount(numbers)
    walks = np.split(nodes[in_order], np.cumsum(lengths)[:-1])
    start = augmented.start
    return EpisodeCounts.of([np.append(start, walk) for walk in walks], len(augmented.nodes), start, augmented.exit)


def measure(
    turns: Turns,
    player: Player,
    episodes: int = 1000,
    progress: Callable[[int], object] = lambda done: None,
    seed: int = 0,
    walk: Walk = PAPER_WALK,
) -> PlayedChain:
    """Play in real levels and report the measured chain next to the assumed walk.

    Args:
        turns: N fresh environments of one goal graph, with autoreset.
        player: a player from `make_player`, a trained `Pair`, or any object with their method ``step``.
        seed: determines the bootstrap.
    """
    counts = count_transitions(turns, player, episodes, progress)
    assumed = analyze(graph_of(turns), turns.config.drop_key, walk)
    return PlayedChain.against(assumed, counts, seed=seed)


def play_rules(
    turns: Turns, player: Player, episodes: int = 1000, progress: Callable[[int], object] = lambda done: None
) -> PlayedRules:
    """Play in new environments, and estimate which goals must be achieved before which others: see `PlayedRules`."""
    facts, play, sequences = EpisodeFacts(len(turns)), Play(turns, player, episodes, progress), []
    if not turns.world.goals.has_target:
        raise InputError(f"{turns.world.variants[0]} has no target, to which rules could lead")
    names, world, variants = turns.world.goals.milestones, turns.world, set()
    for step in play:
        ended = facts.add(step, play.turns, play.envs, play.counted)
        sequences += [[names[milestone] for _, milestone in one] for one in ended.milestones]
        variants.update(ended.variants)
    goals = [names[milestone] for milestone in world.possible_milestones(sorted(variants))]
    is_repeatable = np.broadcast_to(getattr(world, "is_repeatable", False), len(names))
    once = {name for name, again in zip(names, is_repeatable, strict=True) if not again}
    return PlayedRules.of(sequences, goals, names[world.goals.target], once)


def played_by(
    name: str,
    entries: Mapping[str, Any],
    drop_key: bool,
    episodes: int,
    seed: int,
    trust: bool,
    count: Callable[[Turns, Player, int, Callable[[int], object]], T],
) -> T:
    """Return what ``count`` (`measure` or `play_rules`) finds, with a progress bar.

    Args:
        name: `"random"`, `"oracle"`, or the folder of a training run.
        entries: the ``graph`` or ``layout``, ``size`` and ``max_steps``; by default those of the run, or the defaults
            without a run.
        drop_key: whether keys can be dropped; always true for a run that was trained with this.
        trust: whether to run the code that the run's config names, as for `load`.
    """
    require_number("episodes", episodes, 1, 10**9, is_whole=True)
    num_envs = min(MAX_ENVS, episodes)
    if name in ("random", "oracle"):
        config = EnvConfig(drop_key=drop_key, levels="evaluation", **entries)
        config.refuse_unread(entries)
        turns, player = Turns(config, num_envs, seed=seed), make_player(name, seed)
    else:
        agent = load(name, trust=trust)
        turns, player = agent.turns(num_envs, seed=seed, env=agent.env(**entries)), agent.pair(num_envs, seed=seed)
        if drop_key and not turns.config.drop_key:
            raise InputError(f"the agent of {name} was trained without drop, so it cannot play with --drop")
        if (n_graphs := len(turns.world.variants)) > 1:
            raise InputError(f"the agent of {name} was trained on {n_graphs} goal graphs; name one by --graph")
    with progress_bar() as bar:
        task = bar.add_task("playing", total=episodes)
        return count(turns, player, episodes, lambda done: bar.update(task, completed=done))


def graph_of(turns: Turns) -> GoalGraph:
    """Return the goal graph that all levels have."""
    n_graphs, graph = len(turns.world.variants), turns.world.rules
    if turns.config.task is not None:
        raise InputError("the chain of a task is not measured from play; its rules are: --task TASK --from-play PLAYER")
    if n_graphs > 1 or graph is None:
        raise InputError(f"a chain is measured in environments of one goal graph, not of {n_graphs}")
    return graph
