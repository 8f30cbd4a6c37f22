"""The goal graphs that training draws its levels from."""

from __future__ import annotations

from typing import Any

import numpy as np

from hierroom.complexity.difficulty import Curriculum, is_difficulty, parse_difficulty
from hierroom.errors import InputError
from hierroom.goals import GoalGraph, as_goal_graph
from hierroom.turns import Step

EPISODES_PER_STAGE = 200
"""Episodes that began in a stage, at least, before the curriculum judges it."""


class GraphPool:
    """One goal graph, or all graphs of a difficulty, at once or stage by stage.

    Args:
        graph: a letter, a path to a TOML file, or ``hitting_time:LOW..HIGH`` (see `parse_difficulty`).
        drop_key: whether keys can be dropped, which makes every graph harder.
        rooms: how many rooms N draw from it.
        n_stages: parts into which a difficulty is cut; training goes through them as a `Curriculum`.

    Raises:
        InputError: if there is no such graph, or stages are wanted of a single one.
    """

    def __init__(self, graph: str, drop_key: bool, rooms: int, n_stages: int = 1):
        self.everything: tuple[GoalGraph, ...]
        self._curriculum: Curriculum | None = None
        if is_difficulty(graph):
            self._curriculum = Curriculum(parse_difficulty(graph, drop_key), n_stages)
            self.everything = self._curriculum.difficulty.graphs
        elif n_stages != 1:
            raise InputError(f"a curriculum of {n_stages} stages needs a graph like hitting_time:20..30, not {graph!r}")
        else:
            self.everything = (as_goal_graph(graph),)
        self._stage = self._episodes = self._successes = 0
        self._is_older = np.zeros(rooms, bool)  # the episode under way began in another stage

    @property
    def graphs(self) -> tuple[GoalGraph, ...]:
        """The graphs to draw from now."""
        return self.everything if self._curriculum is None else self._curriculum.stages[self._stage].graphs

    def add(self, step: Step) -> bool:
        """Count the episodes of this stage that a step ended; whether this brought other graphs."""
        if self._curriculum is None:
            return False
        self._episodes += int((step.over & ~self._is_older).sum())
        self._successes += int((step.terminated & ~self._is_older).sum())
        self._is_older &= ~step.over
        if self._episodes < EPISODES_PER_STAGE:
            return False
        before = self._stage
        self._stage = self._curriculum.advance(before, self._successes / self._episodes)
        self._episodes = self._successes = 0
        if self._stage == before:
            return False
        self._is_older[:] = True  # in rooms that this step began anew too: they have drawn already
        return True

    def state_dict(self) -> dict[str, Any]:
        """Where the curriculum stands."""
        counts = {"stage": self._stage, "episodes": self._episodes, "successes": self._successes}
        return {**counts, "is_older": self._is_older.tolist()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go back to what `state_dict` gave."""
        self._stage, self._episodes, self._successes = state["stage"], state["episodes"], state["successes"]
        self._is_older[:] = state["is_older"]
