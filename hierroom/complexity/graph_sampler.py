"""The goal graphs from which levels are sampled: one, all of a difficulty, or a curriculum through them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hierroom.complexity.difficulty import Curriculum, is_difficulty, parse_difficulty
from hierroom.errors import InputError
from hierroom.goals import GoalGraph, as_goal_graph

EPISODES_PER_STAGE = 200
"""Least number of episodes that must begin and end in a stage before the curriculum decides about the next stage."""


class GraphSampler:
    """The goal graphs of N environments: one graph, or those of a difficulty, all at once or stage by stage.

    Args:
        graph: a letter, a `GoalGraph`, a path to a TOML file, or ``hitting_time:LOW..HIGH`` (see `parse_difficulty`).
        drop_key: whether keys can be dropped, which makes every graph harder.
        num_envs: number of environments N that sample from these graphs.
        n_stages: number of stages of the `Curriculum` into which a difficulty is divided, at least 1.

    Attributes:
        everything: all graphs that may ever be sampled, the easiest first.

    Raises:
        InputError: if there is no such graph, or a single graph is given with several stages.
    """

    def __init__(self, graph: GoalGraph | str | Path, drop_key: bool, num_envs: int, n_stages: int = 1):
        self.everything: tuple[GoalGraph, ...]
        self._curriculum: Curriculum | None = None
        if isinstance(graph, str) and is_difficulty(graph):
            self._curriculum = Curriculum(parse_difficulty(graph, drop_key), n_stages)
            self.everything = self._curriculum.difficulty.graphs
        elif n_stages != 1:
            raise InputError(f"a curriculum of {n_stages} stages needs a graph like hitting_time:20..30, not {graph!r}")
        else:
            self.everything = (as_goal_graph(graph),)
        self._counts = np.zeros(3, np.int64)  # the stage, and the number of its episodes and successes so far
        self._is_older = np.zeros(num_envs, bool)  # whether the current episode began in another stage

    @property
    def stage(self) -> int:
        """The current stage of the curriculum, counted from 0."""
        return int(self._counts[0])

    @property
    def graphs(self) -> tuple[GoalGraph, ...]:
        """The graphs to sample from in the current stage."""
        return self.everything if self._curriculum is None else self._curriculum.stages[self.stage].graphs

    def add(self, ended: NDArray[np.bool_], escaped: NDArray[np.bool_]) -> bool:
        """Count the episodes of the current stage that a step ended, and change the stage if it is time.

        Args:
            ended: [N] bool, whether the episode ended.
            escaped: [N] bool, whether it ended at the exit.

        Returns:
            Whether `graphs` has changed.
        """
        if self._curriculum is None:
            return False
        self._counts[1:] += (ended & ~self._is_older).sum(), (escaped & ~self._is_older).sum()
        self._is_older &= ~ended
        before, n_episodes, n_successes = self._counts.tolist()
        if n_episodes < EPISODES_PER_STAGE:
            return False
        stage = self._curriculum.advance(before, n_successes / n_episodes)
        self._counts[:] = stage, 0, 0
        if stage == before:
            return False
        self._is_older[:] = True  # also where this step began a new episode, whose graph is already sampled
        return True

    def reset(self) -> None:
        """Note that episodes of the current stage begin in every environment."""
        self._is_older[:] = False

    def get_state(self) -> dict[str, NDArray]:
        """The state of the curriculum as new arrays."""
        return {"curriculum": self._counts.copy(), "is_older": self._is_older.copy()}

    def check_state(self, state: Mapping[str, NDArray]) -> None:
        """Check a state before `set_state`.

        Raises:
            InputError: if there is no such stage.
        """
        n_stages = 1 if self._curriculum is None else len(self._curriculum.stages)
        if not 0 <= state["curriculum"][0] < n_stages:
            raise InputError(f"the stages are 0 to {n_stages - 1}; there is no stage {state['curriculum'][0]}")

    def set_state(self, state: Mapping[str, NDArray]) -> None:
        """Restore what `get_state` returned, after `check_state`."""
        self.check_state(state)
        self._counts[:], self._is_older[:] = state["curriculum"], state["is_older"]
