"""Evaluate a trained agent: ``python -m hierroom.evaluate RUN``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import torch
import tyro
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from scipy.stats import binomtest

from hierroom.agents.player import Player, play
from hierroom.cli import run
from hierroom.env_config import GoalMaskName
from hierroom.errors import InputError
from hierroom.files import to_json
from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS
from hierroom.training.assembly import load_pair, make_turns
from hierroom.training.run_folder import RunFolder
from hierroom.turns import Turns


@dataclass(frozen=True)
class Evaluation:
    """How an agent did over some episodes.

    Args:
        episodes: how many there were.
        success_rate: share that reached the exit.
        success_interval: its 95% interval (Wilson 1927).
        length: mean length in primitive steps.
        length_over_shortest: mean length over mean shortest possible length of the episodes that reached the exit.
        steps_to_goals: for each goal (key and door of room 1, 2, ...; exit) the share of episodes that achieved it and
            the mean step at which they did so first.
    """

    episodes: int
    success_rate: float
    success_interval: tuple[float, float]
    length: float
    length_over_shortest: float
    steps_to_goals: dict[str, tuple[float, float]]


def evaluate(
    player: Player, turns: Turns, episodes: int, progress: Callable[[int], object] = lambda done: None
) -> Evaluation:
    """Let a player play the first episodes of each environment.

    Args:
        player: who plays.
        turns: N fresh environments whose shortest lengths are measured.
        episodes: at least so many in all.
        progress: called with the episodes done so far.
    """
    levels = turns.world.state.levels[["branches", "n_rooms"]].copy()
    n_rooms = 0
    firsts = np.zeros((len(turns), 2 * N_COLOURS + 1), np.int64)
    successes, lengths, shortest, goal_steps = [], [], [], []
    for played in play(turns, player, episodes, progress):
        step, counted = played.step, played.ended
        _note_goals(firsts, levels["branches"], step.events, step.lengths)
        successes.append(step.terminated[counted])
        lengths.append(step.lengths[counted])
        shortest.append(step.shortest[counted])
        goal_steps.append(firsts[counted])
        ended = np.flatnonzero(step.episode_ended)
        firsts[ended] = 0
        n_rooms = int(levels["n_rooms"][counted].max(initial=n_rooms))
        levels[ended] = turns.world.state.levels[["branches", "n_rooms"]][ended]
    success, length, best = np.concatenate(successes), np.concatenate(lengths), np.concatenate(shortest)
    interval = binomtest(int(success.sum()), len(success)).proportion_ci(method="wilson")
    return Evaluation(
        episodes=len(success),
        success_rate=float(success.mean()),
        success_interval=(float(interval.low), float(interval.high)),
        length=float(length.mean()),
        length_over_shortest=float(length[success].mean() / best[success].mean()) if success.any() else float("nan"),
        steps_to_goals=_goal_table(np.concatenate(goal_steps), n_rooms),
    )


def _note_goals(firsts: NDArray, branches: NDArray, events: NDArray, lengths: NDArray) -> None:
    """Write the step of each goal's first time into ``firsts`` [N, 13]: keys and doors by room, the exit last."""
    envs = np.flatnonzero(events >= 0)
    goals = events[envs].copy()
    is_object = goals < EXIT_GOAL
    branch = branches[envs[is_object], goals[is_object] % FIRST_DOOR_GOAL]
    goals[is_object] = goals[is_object] // FIRST_DOOR_GOAL * FIRST_DOOR_GOAL + branch
    is_first = firsts[envs, goals] == 0
    firsts[envs[is_first], goals[is_first]] = lengths[envs[is_first]]


def _goal_table(firsts: NDArray, n_rooms: int) -> dict[str, tuple[float, float]]:
    columns = {f"key {r}": r - 1 for r in range(1, n_rooms)}
    columns |= {f"door {r}": FIRST_DOOR_GOAL + r - 1 for r in range(1, n_rooms)}
    columns["exit"] = EXIT_GOAL
    table = {}
    for name, column in columns.items():
        steps = firsts[:, column]
        achieved = steps > 0
        table[name] = (float(achieved.mean()), float(steps[achieved].mean()) if achieved.any() else float("nan"))
    return table


@dataclass(frozen=True)
class Arguments:
    """Evaluate a trained agent: success, length and steps to each goal, sampling its actions and greedily.

    Args:
        run: the run's folder.
        episodes: episodes to play, at least.
        num_envs: environments to play in side by side.
        seed: fixes the levels and the actions; by default levels that training seeds below a million never saw.
        graph: another goal graph than the one trained on.
        size: another grid size than the one trained on.
        meta: another meta-controller for the trained controller: fixed-dfs, random, oracle, none, an entry point or
            package.module:Class.
        goal_mask: other goals that may be chosen: reachable, existing, seen or none.
        checkpoint: the steps of an earlier checkpoint than the newest.
        json: print JSON for machines; what has no value, such as the mean step of a goal never reached, is null.
    """

    run: Annotated[Path, tyro.conf.Positional]
    episodes: int = 1000
    num_envs: int = 100
    seed: int = 1_000_000
    graph: str | None = None
    size: int | None = None
    meta: str | None = None
    goal_mask: GoalMaskName | None = None
    checkpoint: int | None = None
    json: bool = False


def main() -> int:
    """The command."""
    torch.set_num_threads(1)  # as in training
    arguments = tyro.cli(Arguments, prog="python -m hierroom.evaluate")
    folder = RunFolder.open(arguments.run)
    config = folder.config()
    for name in ("episodes", "num_envs"):
        if getattr(arguments, name) < 1:
            raise InputError(f"{name} must be at least 1, not {getattr(arguments, name)}")
    named = {name: getattr(arguments, name) for name in ("graph", "size", "goal_mask")}
    env = replace(config.env, **{name: value for name, value in named.items() if value is not None})
    config = replace(config, env=env)
    num_envs, seed = min(arguments.num_envs, arguments.episodes), arguments.seed
    where = {"whole_interval": True, "measure_shortest": True}
    turns = {name: make_turns(config, num_envs, seed, **where) for name in ("sampled", "greedy")}
    chosen = {"seed": seed, "meta": arguments.meta, "steps": arguments.checkpoint}
    pairs = {name: load_pair(folder, num_envs, is_greedy=name == "greedy", **chosen) for name in turns}
    results: dict[str, Evaluation] = {}
    with Progress(console=Console(stderr=True), transient=True) as bar:
        for name, pair in pairs.items():
            task = bar.add_task(f"{name} actions", total=arguments.episodes)
            results[name] = evaluate(
                pair, turns[name], arguments.episodes, lambda done, t=task: bar.update(t, completed=done)
            )
    if arguments.json:
        print(to_json({name: asdict(result) for name, result in results.items()}))
    else:
        Console().print(_table(results, f"{folder.path}, {results['sampled'].episodes} episodes"))
    return 0


def _table(results: dict[str, Evaluation], title: str) -> Table:
    table = Table(title=title)
    table.add_column("")
    for name in results:
        table.add_column(f"{name} actions", justify="right")

    def add(label: str, text) -> None:
        table.add_row(label, *(text(result) for result in results.values()))

    add("success", lambda r: f"{r.success_rate:.1%}")
    add("  95% interval", lambda r: "{:.1%} to {:.1%}".format(*r.success_interval))
    add("length", lambda r: f"{r.length:.1f}")
    add("length / shortest, escapes", lambda r: f"{r.length_over_shortest:.2f}")
    for goal in results["sampled"].steps_to_goals:
        add(f"steps to {goal}", lambda r, g=goal: "{1:.1f} ({0:.1%})".format(*r.steps_to_goals[g]))
    return table


if __name__ == "__main__":
    run(main)
