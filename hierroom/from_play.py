"""Measure a chain from the play of whoever the command line names: ``python -m hierroom.complexity --from-play``.

It stands outside `hierroom.complexity`, which knows of no learner.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.progress import Progress

from hierroom.agent import Agent
from hierroom.assembly import make_turns
from hierroom.complexity.difficulty import is_difficulty
from hierroom.complexity.estimate import Player, measure, oracle_player, random_player
from hierroom.complexity.measured import MeasuredReport
from hierroom.errors import InputError
from hierroom.goals import as_goal_graph
from hierroom.runs import RunFolder
from hierroom.turns import Turns
from hierroom.world.batch import Batch

MAX_ROOMS = 100
"""Rooms played in side by side, at most."""


def measure_player(name: str, graph: str | None, drop_key: bool, episodes: int, seed: int) -> MeasuredReport:
    """Play and measure, with a progress bar.

    Args:
        name: `"random"`, `"oracle"`, or the folder of a training run, whose settings the rooms then have.
        graph: a goal graph as users name it; None for the run's, and for `"random"` and `"oracle"` graph c.
        drop_key: whether keys can be dropped; a run that trained so has it on anyway.
        episodes: at least so many.
        seed: fixes the levels, the actions and the bootstrap.

    Raises:
        InputError: if there is no such run, or an argument is not valid.
    """
    if episodes < 1:
        raise InputError(f"play at least one episode, not {episodes}")
    rooms = min(MAX_ROOMS, episodes)
    if name in ("random", "oracle"):
        world = Batch([as_goal_graph(graph or "c")], rooms, drop_key=drop_key, seed=seed)
        turns = Turns(world)
        player: Player = oracle_player() if name == "oracle" else random_player(np.random.default_rng(seed))
    else:
        turns, player = _trained(name, graph, drop_key, rooms, seed)
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("playing", total=episodes)
        return measure(turns, player, episodes, lambda done: bar.update(task, completed=done), seed)


def _trained(name: str, graph: str | None, drop_key: bool, rooms: int, seed: int) -> tuple[Turns, Player]:
    folder = RunFolder.open(name)
    config = folder.config()
    if drop_key and not config.drop_key:
        raise InputError(f"the agent of {name} was trained without drop, so it cannot play with --drop")
    if graph is None and is_difficulty(config.graph):
        raise InputError(f"the agent of {name} was trained on {config.graph}; name one goal graph by --graph")
    config = replace(config, graph=graph or config.graph)
    return make_turns(config, rooms, seed), Agent.load(folder, rooms, seed=seed).step
