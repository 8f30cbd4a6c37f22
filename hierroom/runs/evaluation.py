"""Evaluation of a player: success, length, and steps to each goal over some episodes, by goal graph and in all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierroom.agents.player import Player, play
from hierroom.complexity.played.observed import wilson_interval
from hierroom.goals import EXIT_GOAL, N_COLOURS, ROOM_GOAL_NAMES, room_goals
from hierroom.turns.step import Step
from hierroom.turns.turns import Turns


class SuccessInterval(NamedTuple):
    """A confidence interval of a success rate."""

    low: float
    high: float


class GoalSteps(NamedTuple):
    """The fraction of episodes that achieved a goal, and the mean step at which they first did."""

    fraction: float
    mean_step: float


@dataclass(frozen=True)
class Score:
    """How well a player did in some episodes.

    Args:
        episodes: number of episodes.
        success_rate: fraction that reached the exit.
        success_interval: its 95% confidence interval (Wilson 1927).
        length: mean length in primitive steps.
        length_over_shortest: mean length divided by mean shortest possible length, over the episodes that reached the
            exit; NaN if none did.
        mean_return: mean sum of the controller's rewards, undiscounted.
        steps_to_goals: for each goal (key and door of room 1, 2, ...; exit) how many achieved it, and when.
    """

    episodes: int
    success_rate: float
    success_interval: SuccessInterval
    length: float
    length_over_shortest: float
    mean_return: float
    steps_to_goals: dict[str, GoalSteps]


@dataclass(frozen=True)
class Evaluation(Score):
    """The results of a player over some episodes.

    Args:
        graphs: the same numbers for each goal graph that was played, by its name, the easiest first.
    """

    graphs: dict[str, Score]


class _Episodes(NamedTuple):
    """[E] of each: what there is to know of episodes."""

    graphs: NDArray[np.str_]
    rooms: NDArray[np.integer]
    successes: NDArray[np.bool_]
    lengths: NDArray[np.integer]
    shortest: NDArray[np.integer]
    returns: NDArray[np.float64]
    firsts: NDArray[np.integer]

    def where(self, chosen: NDArray[np.bool_]) -> _Episodes:
        return _Episodes._make(values[chosen] for values in self)


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
    levels, returns = turns.world.state.levels.copy(), np.zeros(len(turns))
    firsts = np.zeros((len(turns), len(ROOM_GOAL_NAMES)), np.int64)
    parts = []
    for played in play(turns, player, episodes, progress):
        step, envs, rows = played.step, played.envs, played.ended
        returns[envs] += step.rewards
        _note_goals(firsts, envs, levels["branches"], step)
        if len(rows):
            ended = envs[rows]
            graphs = np.array(turns.sampler.names(levels[ended]))
            told = (values[rows] for values in (step.terminated, step.lengths, step.shortest))
            parts.append((graphs, levels["n_rooms"][ended], *told, returns[ended], firsts[ended]))
        if played.turns.n_ended:
            begun = np.flatnonzero(step.episode_ended)
            firsts[envs[begun]], returns[envs[begun]] = 0, 0.0
            levels[envs[begun]] = played.turns.world.state.levels[begun]
    played_episodes = _Episodes._make(map(np.concatenate, zip(*parts, strict=True)))
    names = [graph.name for graph in turns.sampler.everything]
    return Evaluation(
        **vars(_score(played_episodes)),
        graphs={
            name: _score(played_episodes.where(played_episodes.graphs == name))
            for name in dict.fromkeys(names)
            if (played_episodes.graphs == name).any()
        },
    )


def _score(episodes: _Episodes) -> Score:
    success, length = episodes.successes, episodes.lengths
    success_rate, *interval = wilson_interval(float(success.mean()), len(success), level=0.95)
    shortest = episodes.shortest[success].mean() if success.any() else float("nan")
    return Score(
        episodes=len(success),
        success_rate=success_rate,
        success_interval=SuccessInterval(*interval),
        length=float(length.mean()),
        length_over_shortest=float(length[success].mean() / shortest) if success.any() else float("nan"),
        mean_return=float(episodes.returns.mean()),
        steps_to_goals=_goal_table(episodes.firsts, int(episodes.rooms.max())),
    )


def _note_goals(firsts: NDArray, stepped: NDArray[np.integer], branches: NDArray, step: Step) -> None:
    """Write the step at which each goal was first achieved into ``firsts`` [N, 13]: keys, doors by room, then exit."""
    rows = np.flatnonzero(step.events >= 0)
    if not len(rows):
        return
    envs, lengths = stepped[rows], step.lengths[rows]
    goals = room_goals(step.events[rows], branches[envs])
    is_first = firsts[envs, goals] == 0
    firsts[envs[is_first], goals[is_first]] = lengths[is_first]


def _goal_table(firsts: NDArray, n_rooms: int) -> dict[str, GoalSteps]:
    columns = [c for c in range(len(ROOM_GOAL_NAMES)) if c == EXIT_GOAL or c % N_COLOURS < n_rooms - 1]
    table = {}
    for column in columns:
        steps = firsts[:, column]
        achieved = steps > 0
        mean_step = float(steps[achieved].mean()) if achieved.any() else float("nan")
        table[ROOM_GOAL_NAMES[column]] = GoalSteps(float(achieved.mean()), mean_step)
    return table
