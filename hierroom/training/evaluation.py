"""Evaluation of a player: success, length, and steps to each goal over some episodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from hierroom.agents.player import Player, play
from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS
from hierroom.turns import Turns


@dataclass(frozen=True)
class Evaluation:
    """The results of a player over some episodes.

    Args:
        episodes: number of episodes.
        success_rate: fraction that reached the exit.
        success_interval: its 95% confidence interval (Wilson 1927).
        length: mean length in primitive steps.
        length_over_shortest: mean length divided by mean shortest possible length, over the episodes that reached the
            exit.
        steps_to_goals: for each goal (key and door of room 1, 2, ...; exit) the fraction of episodes that achieved it
            and the mean step at which they first did.
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
        player: the player.
        turns: N fresh environments that measure shortest lengths.
        episodes: how many in all.
        progress: called with the number of episodes done so far.
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
    """Write the step at which each goal was first achieved into ``firsts`` [N, 13]: keys, doors by room, then exit."""
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
