"""The parts of a task that its worlds, environments and replays read."""

# Protocol methods have only a docstring.
# pyright: reportReturnType=false
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import gymnasium
from gymnasium import spaces

from hierroom.goals.goal_set import GoalSet
from hierroom.goals.rules import Rules
from hierroom.worlds.task.goal_values import GoalFunction
from hierroom.worlds.world import Feature


@dataclass(frozen=True)
class Trial:
    """Facts found by a few random steps in one environment of a task.

    Args:
        entries: its observation entries by flat name: the path of keys to each, and its space.
        left_out: names of entries that no network reads, such as texts.
        n_actions: its number of actions.
        first_action: the number of its first action.
        are_counts: [G] whether each goal is a count, which can be achieved again.
    """

    entries: Mapping[str, tuple[tuple[Any, ...], spaces.Space]]
    left_out: Sequence[str]
    n_actions: int
    first_action: int
    are_counts: tuple[bool, ...]


class TaskParts(Protocol):
    """The attributes of a `Task` that its worlds and replays use."""

    @property
    def name(self) -> str:
        """The name in titles, tables and errors."""

    @property
    def goals(self) -> Mapping[str, GoalFunction]:
        """The user's functions."""

    @property
    def goal_set(self) -> GoalSet:
        """The goals as agents know them."""

    @property
    def rules(self) -> Rules | None:
        """The dependencies of the goals, if they are known."""

    @property
    def max_steps(self) -> int:
        """Default number of steps after which an episode is truncated."""

    @property
    def processes(self) -> int:
        """Number of processes for the environments; 0: this process."""

    @property
    def trial(self) -> Trial:
        """Facts found by a few random steps."""

    @property
    def n_actions(self) -> int:
        """The controller's number of actions."""

    @property
    def features(self) -> Mapping[str, Feature]:
        """Features that networks can read."""

    def new_env(self, render_mode: str | None = None) -> gymnasium.Env:
        """Return a new environment, in a render mode if it takes one."""
