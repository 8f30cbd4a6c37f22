"""The episodes of training: a row for each, and means over the latest ones."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from hierroom.agents.episode_facts import Achievements, EpisodeFacts
from hierroom.agents.evaluation import geometric_mean
from hierroom.goals.goal_set import GoalSet, column_name
from hierroom.support.schema import Array, Items, Real, Table, Whole, as_array
from hierroom.turns.records import Step
from hierroom.turns.turns import Turns

WINDOW = 500
"""Number of episodes over which success, length and return are averaged."""
MOST_NAMED = 250
"""The most milestones of an episode that its row names, as a task's goal can count every step; and each at least once.

The row lists them as JSON, with the number of the others, if any, as the last entry.
"""

_COLUMNS = ("steps", "env", "graph", "success", "length", "return", "goals")


class EpisodeLog:
    """Success, length and return of the last 500 episodes; ``ended`` has the rows of those since `begin_update`.

    ``clocks`` [N] are the steps that each environment's first episode counts before its first step.
    """

    def __init__(self, goals: GoalSet, clocks: NDArray[np.integer]) -> None:
        num_envs, self._clocks = len(clocks), np.array(clocks, np.int64)
        self.episodes = 0
        self.ended: list[dict[str, object]] = []
        windows = ("success", "length", "return", *(["achieved"] if goals.outcome == "score" else []))
        self._window: dict[str, deque[Any]] = {name: deque(maxlen=WINDOW) for name in windows}  # achieved: bits
        self._facts = EpisodeFacts(num_envs)
        self._goals, self._kinds = goals, np.append(goals.kind_of, len(goals.kinds))  # the last is of no goal
        self._options = np.zeros((2, 1 + len(goals.kinds)), np.int64)  # that ended, that reached their goal

    def begin_update(self) -> None:
        """Delete the rows and option counts of the last update."""
        self.ended.clear()
        self._options[:] = 0

    def add(self, step: Step, turns: Turns, steps: int) -> None:
        """Record a step in ``turns`` and the episodes that it ended; ``steps`` are the steps of training so far."""
        kinds = self._kinds[step.goals]
        for row, chosen in enumerate((step.option_ended, step.reached)):
            self._options[row] += np.bincount(kinds[chosen], minlength=self._options.shape[1])
        ended = self._facts.add(step, turns)
        if not len(ended):
            return
        numbers = {
            "success": ended.successes.astype(np.int64).tolist(),
            "length": (ended.lengths - self._clocks[ended.envs]).tolist(),
            "return": ended.returns.round(6).tolist(),
        }
        for name, values in numbers.items():
            self._window[name].extend(values)
        if "achieved" in self._window:
            self._window["achieved"].extend(
                sum(1 << goal for goal in {goal for _, goal in one}) for one in ended.milestones
            )
        if not self._goals.has_target:
            numbers["success"] = [np.nan] * len(ended)
        achieved = [self._named(one) for one in ended.milestones]
        for row in zip(ended.envs.tolist(), ended.variants, *numbers.values(), achieved, strict=True):
            self.ended.append(dict(zip(_COLUMNS, (steps, *row), strict=True)))
        self._clocks[ended.envs] = 0
        self.episodes += len(ended)

    def _named(self, achieved: Achievements) -> str:
        milestones = [milestone for _, milestone in achieved]
        named = milestones[:MOST_NAMED]
        named += [milestone for milestone in dict.fromkeys(milestones[MOST_NAMED:]) if milestone not in named]
        n_more = len(milestones) - len(named)
        listed = [self._goals.milestones[milestone] for milestone in named]
        return json.dumps([*listed, n_more] if n_more else listed, ensure_ascii=False)

    @property
    def means(self) -> dict[str, float]:
        """Means over the window; before an episode has ended, NaN, but 0 for the success rate; NaN without a target.

        The score is there only if it is what counts.
        """
        length, returned = (np.mean(self._window[name] or np.nan) for name in ("length", "return"))
        success = np.mean(self._window["success"] or 0.0) if self._goals.has_target else np.nan
        means = {"success_rate": float(success), "episode_length": float(length), "episode_return": float(returned)}
        return means if "achieved" not in self._window else {**means, "score": self._score()}

    def _score(self) -> float:
        bits = np.array(self._window["achieved"] or [0], np.int64)[:, None]
        return float(geometric_mean((bits >> np.arange(len(self._goals)) & 1).mean(axis=0)))

    @property
    def reached(self) -> dict[str, float]:
        """The share of options that reached their goal among those ended since `begin_update`, by kind; NaN if none."""
        ended, reached = self._options.tolist()
        shares = zip((*self._goals.kinds, "new"), ended, reached, strict=True)
        return {f"reached_{column_name(kind)}": got / n if n else float("nan") for kind, n, got in shares}

    def state_dict(self) -> dict[str, Any]:
        """Return the state without the rows, as tensors and plain types."""
        achieved = [(env, at, goal) for env, one in enumerate(self._facts.achieved) for at, goal in one]  # [K, 3]
        return {
            "episodes": self.episodes,
            "window": {name: list(values) for name, values in self._window.items()},
            "returns": torch.from_numpy(self._facts.returns.copy()),
            "achieved": torch.from_numpy(np.array(achieved, np.int64).reshape(-1, 3)),
            "clocks": torch.from_numpy(self._clocks.copy()),
        }

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Restore what `state_dict` returned."""
        n, ranges = len(self._clocks), {"success": Whole(0, 1), "length": Whole(1), "return": Real()}
        if "achieved" in self._window:
            ranges["achieved"] = Whole(0, 2 ** len(self._goals) - 1)
        achieved = as_array(state.get("achieved"), "log.achieved")  # of any length
        limits: Any = ((0, 1, 0), (n - 1, 2**62, len(self._goals) - 1))
        Table(
            {
                "episodes": Whole(0, 2**62),
                "window": Table({name: Items(entry, 0, WINDOW) for name, entry in ranges.items()}),
                "returns": Array(np.float64, (n,)),
                "achieved": Array(np.int64, (*achieved.shape[:1], 3), *limits),
                "clocks": Array(np.int64, (n,), low=0),
            }
        ).check(state, "log")
        self.episodes = state["episodes"]
        self._window = {name: deque(values, WINDOW) for name, values in state["window"].items()}
        self._facts.returns = state["returns"].numpy().copy()
        self._facts.achieved = [[] for _ in range(n)]
        for env, at, goal in achieved.tolist():
            self._facts.achieved[env].append((at, goal))
        self._clocks = state["clocks"].numpy().copy()
        self.ended = []
