"""The goal graphs that levels are drawn from: one, all of a difficulty, or a curriculum through them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hierroom.complexity.difficulty import Curriculum, is_difficulty, parse_difficulty
from hierroom.errors import InputError
from hierroom.goals import GoalGraph, as_goal_graph

EPISODES_PER_STAGE = 200
"""Episodes that began in a stage, at least, before the curriculum judges it."""


class GraphSampler:
    """One goal graph, or all graphs of a difficulty, at once or stage by stage.

    Args:
        graph: a letter, a `GoalGraph`, a path to a TOML file, or ``hitting_time:LOW..HIGH`` (see `parse_difficulty`).
        drop_key: whether keys can be dropped, which makes every graph harder.
        num_envs: how many environments N draw from it.
        n_stages: parts into which a difficulty is cut; one goes through them as a `Curriculum`.

    Attributes:
        everything: all graphs it may ever draw from, the easiest first.

    Raises:
        InputError: if there is no such graph, or stages are wanted of a single one.
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
        self._counts = np.zeros(3, np.int64)  # the stage, and its episodes and successes so far
        self._is_older = np.zeros(num_envs, bool)  # the episode under way began in another stage

    @property
    def stage(self) -> int:
        """Which stage of the curriculum it is in, from 0 on."""
        return int(self._counts[0])

    @property
    def graphs(self) -> tuple[GoalGraph, ...]:
        """The graphs to draw from now."""
        return self.everything if self._curriculum is None else self._curriculum.stages[self.stage].graphs

    def add(self, ended: NDArray[np.bool_], escaped: NDArray[np.bool_]) -> bool:
        """Count the episodes of this stage that a step ended.

        Args:
            ended: [N] bool, the episode ended.
            escaped: [N] bool, it ended at the exit.

        Returns:
            Whether other graphs are to be drawn from now on.
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
        self._is_older[:] = True  # in environments that this step began anew too: they have drawn already
        return True

    def reset(self) -> None:
        """Episodes begin in every environment, all of them in the stage of now."""
        self._is_older[:] = False

    def get_state(self) -> dict[str, NDArray]:
        """Where the curriculum stands, as fresh arrays."""
        return {"curriculum": self._counts.copy(), "is_older": self._is_older.copy()}

    def check_state(self, state: Mapping[str, NDArray]) -> None:
        """Refuse what `get_state` cannot have given.

        Raises:
            InputError: if there is no such stage.
        """
        n_stages = 1 if self._curriculum is None else len(self._curriculum.stages)
        if not 0 <= state["curriculum"][0] < n_stages:
            raise InputError(f"the stages are 0 to {n_stages - 1}; there is no stage {state['curriculum'][0]}")

    def set_state(self, state: Mapping[str, NDArray]) -> None:
        """Go back to what `get_state` gave; `check_state` says what is refused."""
        self.check_state(state)
        self._counts[:], self._is_older[:] = state["curriculum"], state["is_older"]
