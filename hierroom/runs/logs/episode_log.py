"""The episodes of training: a row for each that ends, and what the last of them were like."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from itertools import islice
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from hierroom.goals import N_COLOURS, N_GOALS, NO_GOAL, ROOM_GOAL_NAMES, room_goals
from hierroom.support.schema import Array, Items, Real, Table, Whole
from hierroom.turns.records import Step
from hierroom.turns.turns import Turns

WINDOW = 500
"""Number of episodes over which success, length and return are averaged."""

_COLUMNS = ("steps", "env", "graph", "success", "length", "return", "goals")
OPTION_KINDS = ("key", "door", "exit", "new")
"""Kinds of goals; without a goal the controller is asked for something new."""


class EpisodeLog:
    """Success, length and return of the last 500 episodes, and all that there is to say of those that just ended.

    Args:
        clocks: [N] steps that the first episode of each environment counts as taken before its first.

    Attributes:
        episodes: number of episodes that have ended.
        ended: rows of ``episodes.csv`` for the episodes that ended since `begin_update`.
    """

    def __init__(self, clocks: NDArray[np.integer]) -> None:
        num_envs, self._clocks = len(clocks), np.array(clocks, np.int64)
        self.episodes = 0
        self.ended: list[dict[str, object]] = []
        self._window: dict[str, deque[float]] = {name: deque(maxlen=WINDOW) for name in ("success", "length", "return")}
        self._returns = np.zeros(num_envs)
        self._goals: list[list[int]] = [[] for _ in range(num_envs)]
        self._options = np.zeros((2, len(OPTION_KINDS)), np.int64)  # those that ended, those that reached their goal

    def begin_update(self) -> None:
        """Forget what was only to be said of the steps before the last update."""
        self.ended.clear()
        self._options[:] = 0

    def add(self, step: Step, turns: Turns, steps: int) -> None:
        """Record a step, and the episodes that it ended in the order of their environments.

        Args:
            step: the step.
            turns: the environments in which it was taken, which begin their next episodes by themselves.
            steps: number of primitive steps trained so far.
        """
        self._returns += step.rewards
        kinds = np.where(step.goals == NO_GOAL, OPTION_KINDS.index("new"), step.goals // N_COLOURS)
        for row, chosen in enumerate((step.option_ended, step.reached)):
            self._options[row] += np.bincount(kinds[chosen], minlength=len(OPTION_KINDS))
        for env in np.flatnonzero(step.events != NO_GOAL).tolist():
            self._goals[env].append(int(step.events[env]))
        ended = np.flatnonzero(step.episode_ended)
        if not len(ended):
            return
        finals = turns.world.finals[ended]
        envs, graphs = ended.tolist(), turns.sampler.names(finals)
        numbers = {
            "success": step.terminated[ended].astype(np.int64).tolist(),
            "length": (step.lengths - self._clocks)[ended].tolist(),
            "return": self._returns[ended].round(6).tolist(),
        }
        for name, values in numbers.items():
            self._window[name].extend(values)
        achieved = self._achieved(envs, finals["branches"])
        for row in zip(envs, graphs, *numbers.values(), achieved, strict=True):
            self.ended.append(dict(zip(_COLUMNS, (steps, *row), strict=True)))
        self._returns[ended], self._clocks[ended] = 0.0, 0
        self.episodes += len(ended)

    def _achieved(self, envs: list[int], branches: NDArray[np.integer]) -> list[str]:
        """What the episodes that ended in some environments achieved, in words; it is forgotten."""
        goals = [self._goals[env] for env in envs]
        counts = [len(one) for one in goals]
        flat = np.array([goal for one in goals for goal in one], np.int64)
        names = iter([ROOM_GOAL_NAMES[goal] for goal in room_goals(flat, np.repeat(branches, counts, axis=0)).tolist()])
        for env in envs:
            self._goals[env] = []
        return [" > ".join(islice(names, count)) for count in counts]

    @property
    def success_rate(self) -> float:
        """Fraction of the window's episodes that reached the exit; 0 before the first episode ends."""
        return self._mean("success") if self.episodes else 0.0

    @property
    def episode_length(self) -> float:
        """Mean length of the window's episodes in primitive steps; NaN before the first episode ends."""
        return self._mean("length")

    @property
    def episode_return(self) -> float:
        """Mean sum of the controller's rewards in the window's episodes; NaN before the first episode ends."""
        return self._mean("return")

    @property
    def reached(self) -> dict[str, float]:
        """The share of the options ended since `begin_update` that reached their goal, by its kind; NaN of none."""
        ended, reached = self._options.tolist()
        shares = zip(OPTION_KINDS, ended, reached, strict=True)
        return {f"reached_{kind}": got / n if n else float("nan") for kind, n, got in shares}

    def _mean(self, name: str) -> float:
        return float(np.mean(self._window[name])) if self._window[name] else float("nan")

    def state_dict(self) -> dict[str, Any]:
        """The complete state, but for what has ended, as tensors and plain types."""
        return {
            "episodes": self.episodes,
            "window": {name: list(values) for name, values in self._window.items()},
            "returns": torch.from_numpy(self._returns.copy()),
            "goals": [list(goals) for goals in self._goals],
            "clocks": torch.from_numpy(self._clocks.copy()),
        }

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Restore what `state_dict` returned."""
        n, ranges = len(self._goals), {"success": Whole(0, 1), "length": Whole(1), "return": Real()}
        Table(
            {
                "episodes": Whole(0, 2**62),
                "window": Table({name: Items(entry, 0, WINDOW) for name, entry in ranges.items()}),
                "returns": Array(np.float64, (n,)),
                "goals": Items(Items(Whole(0, N_GOALS - 1)), n, n),
                "clocks": Array(np.int64, (n,), low=0),
            }
        ).check(state, "log")
        self.episodes = state["episodes"]
        self._window = {name: deque(values, WINDOW) for name, values in state["window"].items()}
        self._returns = state["returns"].numpy().copy()
        self._goals = [list(goals) for goals in state["goals"]]
        self._clocks = state["clocks"].numpy().copy()
        self.ended = []
