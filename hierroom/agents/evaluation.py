"""Evaluation of a player: success, length, and steps to each goal, over all episodes and for each goal graph."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.agents.episode_facts import EndedEpisodes, EpisodeFacts
from hierroom.agents.player import Play, Player
from hierroom.goals.goal_set import column_name
from hierroom.support.intervals import wilson_interval
from hierroom.turns.turns import Turns
from hierroom.worlds.base import BaseWorld


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
    """The results of a player over some episodes."""

    episodes: int
    success_rate: float  # fraction that reached the target; NaN without a target
    success_interval: SuccessInterval  # its 95% confidence interval (Wilson 1927)
    length: float  # mean, in primitive steps
    length_over_shortest: float  # mean length over mean shortest length, of successful episodes; or NaN
    mean_return: float  # mean sum of the controller's rewards, undiscounted
    score: float  # `geometric_mean` of the goals' shares; NaN with a target, or without goals
    steps_to_goals: dict[str, GoalSteps]  # by milestone, such as key 1, door 1 and exit

    @property
    def columns(self) -> dict[str, float]:
        """Success, its interval, length and return, by the names of columns in tables."""
        low, high = self.success_interval
        success = {"success_rate": self.success_rate, "success_low": low, "success_high": high}
        lengths = {"length": self.length, "length_over_shortest": self.length_over_shortest}
        score = {} if math.isnan(self.score) else {"score": self.score}
        return {**success, **lengths, "return": self.mean_return, **score}

    @property
    def goal_columns(self) -> dict[str, float]:
        """Return the share of episodes that achieved each goal, and its mean step, by their columns in tables."""
        columns = {}
        for goal, (share, step) in self.steps_to_goals.items():
            name = column_name(goal)
            columns |= {f"achieved_{name}": share, f"steps_to_{name}": step}
        return columns


@dataclass(frozen=True)
class Evaluation(Score):
    """The results of a player over all episodes, and over those of each goal graph."""

    graphs: dict[str, Score]  # by name, the easiest first


def geometric_mean(shares: ArrayLike) -> NDArray[np.float64]:
    """Return the score of shares [..., G] of episodes that achieved each goal: from 0 to 1, as the shares are.

    With the shares in percent, s, Crafter's score is ``exp(mean_i ln(1 + s_i)) - 1`` percent, which this divides by 100
    (Hafner 2021, "Benchmarking the Spectrum of Agent Capabilities", arXiv:2109.06780, section 4).

    Examples:
        >>> from hierroom.agents.evaluation import geometric_mean
        >>> round(float(geometric_mean([1.0, 0.0])), 4), round(float(geometric_mean([0.5, 0.5])), 4)
        (0.0905, 0.5)
    """
    mean = np.log1p(100 * np.asarray(shares, float)).mean(axis=-1)
    return np.minimum(np.expm1(mean) / 100, 1.0)  # rounded, it may be above 1


def outcome_in_words(
    success_rate: float, mean_return: float, score: float = math.nan, digits: int = 0
) -> tuple[str, str]:
    """Return what counts, success or without a target the score or the return, and its number as text."""
    if math.isnan(success_rate) and math.isnan(score):
        return "return", "-" if math.isnan(mean_return) else f"{mean_return:.5g}"
    name, share = ("score", score) if math.isnan(success_rate) else ("success", success_rate)
    return name, f"{share:.{digits}%}"


def evaluate(
    player: Player,
    turns: Turns,
    episodes: int,
    progress: Callable[[int], object] = lambda done: None,
    *,
    may_stop: bool = False,
) -> Evaluation:
    """Let a player play episodes, the first ones of each environment; ``turns`` are new and measure shortest lengths.

    With ``may_stop``, the evaluation stops early for a player that succeeds in fewer than half of the episodes, as
    failures take long. It then has equally many episodes of each environment. It stops when the interval of the success
    rate is at most as wide as it would be for all episodes at a rate of 50%.
    """
    facts, play, parts = EpisodeFacts(len(turns)), Play(turns, player, episodes, progress), []
    may_stop = may_stop and turns.world.goals.has_target
    rounds, width = 0, _width(0.5, episodes)
    for step in play:
        completed = int(play.played.min()) if may_stop else 0
        if completed > rounds:
            rounds = completed
            played = EndedEpisodes.joined(parts)
            order = np.argsort(played.envs, kind="stable")
            starts = np.searchsorted(played.envs[order], played.envs[order])
            is_first = np.zeros(len(played), bool)
            is_first[order] = np.arange(len(played)) - starts < rounds
            first = played.where(is_first)
            if (rate := first.successes.mean()) < 0.5 and _width(rate, len(first)) <= width:
                parts = [first]
                break
        if len(ended := facts.add(step, play.turns, play.envs, play.counted)):
            parts.append(ended)
    played, world = EndedEpisodes.joined(parts), turns.world
    names = np.array(played.variants)
    by_graph = {name: names == name for name in world.variants}
    return Evaluation(
        **vars(_score(played, world)),
        graphs={name: _score(played.where(is_of), world) for name, is_of in by_graph.items() if is_of.any()},
    )


def _width(success_rate: float, episodes: int) -> float:
    _, low, high = wilson_interval(success_rate, episodes, level=0.95)
    return high - low


def _score(episodes: EndedEpisodes, world: BaseWorld) -> Score:
    success, length = episodes.successes, episodes.lengths
    success_rate, *interval = wilson_interval(float(success.mean()), len(success), level=0.95)
    if not world.goals.has_target:
        success_rate, interval = math.nan, [math.nan, math.nan]
    is_known = success.any() and episodes.shortest[success].min() >= 0
    shortest = episodes.shortest[success].mean() if is_known else float("nan")
    firsts = np.zeros((len(episodes), len(world.goals.milestones)), np.int64)
    for row, achieved in zip(firsts, episodes.milestones, strict=True):
        for at, milestone in reversed(achieved):
            row[milestone] = at
    goals = {}
    for milestone in world.possible_milestones(episodes.variants):
        steps = firsts[:, milestone][firsts[:, milestone] > 0]
        mean_step = float(steps.mean()) if len(steps) else float("nan")
        goals[world.goals.milestones[milestone]] = GoalSteps(len(steps) / len(firsts), mean_step)
    score = geometric_mean([goal.fraction for goal in goals.values()]) if world.goals.outcome == "score" else math.nan
    return Score(
        episodes=len(success),
        success_rate=success_rate,
        success_interval=SuccessInterval(*interval),
        length=float(length.mean()),
        length_over_shortest=float(length[success].mean() / shortest) if is_known else float("nan"),
        mean_return=float(episodes.returns.mean()),
        score=float(score),
        steps_to_goals=goals,
    )
