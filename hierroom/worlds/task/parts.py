"""The parts of a task that its worlds, environments and replays read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import gymnasium
from gymnasium import spaces
from gymnasium.vector import VectorEnv

from hierroom.goals.goal_set import GoalSet
from hierroom.goals.rules import Rules
from hierroom.worlds.actions import Actions
from hierroom.worlds.task.goal_values import GoalFunction
from hierroom.worlds.task.masks import MaskPlace
from hierroom.worlds.world import Feature


@dataclass(frozen=True)
class Trial:
    """Facts found by a few random steps in one environment of a task.

    Args:
        entries: its observation entries by flat name: the path of keys to each, and its space.
        left_out: names of entries that no network reads, such as texts.
        actions: the kind of its actions.
        are_counts: [G] whether each goal is a count, which can be achieved again.
        symbols: entries that are grids of symbols: how many symbols a network tells apart in each.
        step_seconds: median time of a step.
        mask: where environments say which actions are legal; None: nowhere.
        limit: steps after which its environments truncate an episode, by their ``spec``; None if it names none.
    """

    entries: Mapping[str, tuple[tuple[Any, ...], spaces.Space]]
    left_out: Sequence[str]
    actions: Actions
    are_counts: tuple[bool, ...]
    symbols: Mapping[str, int]
    step_seconds: float
    mask: MaskPlace | None = None
    limit: int | None = None


class TaskParts(Protocol):
    """The attributes of a `Task` that its worlds, environments and replays use; `Task` describes them."""

    name: str
    label: str | None
    goals: Mapping[str, GoalFunction]
    goal_set: GoalSet
    rules: Rules | None
    max_steps: int
    processes: int
    symbols: Sequence[str] | None
    action_mask: str | None
    trial: Trial
    features: Mapping[str, Feature]
    replayer: Any
    make_vec: Any

    def new_env(self, render_mode: str | None = None) -> gymnasium.Env:
        """Return a new environment, in a render mode if it takes one."""
        ...  # pyright: ignore[reportReturnType]

    def new_vector(self, num_envs: int) -> VectorEnv:
        """Return a new vector of environments, of a task with ``make_vec``."""
        ...  # pyright: ignore[reportReturnType]
