"""Workshops as tasks, from a random tech tree or a user's own rules."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from gymnasium import spaces

from hierroom.goals import Rules
from hierroom.goals.goal_set import GoalSet
from hierroom.support.errors import InputError, shown
from hierroom.worlds.env_config import DEFAULT_MAX_STEPS, EnvConfig
from hierroom.worlds.workshop.features import features_of
from hierroom.worlds.workshop.recipes import Book, book_of
from hierroom.worlds.workshop.replayer import WorkshopReplayer
from hierroom.worlds.workshop.shortest import Solver
from hierroom.worlds.workshop.tech_tree import tech_tree_of
from hierroom.worlds.workshop.world import WorkshopWorld


@dataclass(frozen=True)
class WorkshopTask:
    """A workshop of some rules, as a `hierroom.worlds.make.WorldMaker`; equal rules and labels give equal tasks.

    Args:
        rules: the recipes.
        label: the name in titles and tables; None: ``package.module:name``, if the task is given so.
    """

    rules: Rules
    label: str | None
    controller_features = ("goal-shelf", "goal-bench", "symbol", "shelf", "stock", "bench", "previous-action")
    meta_features = ("goal-status", "stock", "bench", "goal-outcome")
    max_steps = DEFAULT_MAX_STEPS

    def __post_init__(self) -> None:
        self.book  # refuses rules that cannot be a workshop  # noqa: B018

    def __getstate__(self) -> dict[str, Any]:
        """Pickle and copy only rules and label, because features contain functions without a name."""
        return {"rules": self.rules, "label": self.label}

    @property
    def name(self) -> str:
        """The label, or ``rules``."""
        return self.label or self.rules.name

    @cached_property
    def book(self) -> Book:
        """The recipes of the rules."""
        return book_of(self.rules)

    @cached_property
    def solver(self) -> Solver:
        """The solver of shortest solutions."""
        return Solver(self.book.recipes)

    @cached_property
    def goal_set(self) -> GoalSet:
        """The goals, named like the rules; the target is the first rule that makes the rules' target."""
        names = self.rules.names
        return GoalSet.one_hot(names, names[self.book.recipes.last_goal])

    @property
    def n_actions(self) -> int:
        """The number of actions: one for each place, one to work and one to clear."""
        return len(self.book.recipes.standing) + 2

    @cached_property
    def features(self) -> Any:
        """Features that networks can read."""
        return features_of(self.book)

    @cached_property
    def replayer(self) -> WorkshopReplayer:
        """The replayer, which replays episodes and draws them."""
        return WorkshopReplayer(self)

    @cached_property
    def observation_spaces(self) -> dict[str, spaces.Space]:
        """The spaces of `WorkshopView.as_dict`."""
        recipes = self.book.recipes
        most = int(recipes.limits[recipes.standing].max())
        row = np.array([len(self.book.things) - 1, most, min(most, recipes.room)], np.uint8)
        high = np.tile(row, (len(recipes.standing), 1))
        return {"observation": spaces.Box(np.zeros_like(high), high, dtype=np.uint8)}

    def make_world(self, config: EnvConfig, num_envs: int, **settings: Any) -> WorkshopWorld:
        """Return N workshops."""
        return WorkshopWorld(self, config, num_envs, **settings)


@cache
def workshop_of(spec: str) -> WorkshopTask:
    """Return the workshop of a random tech tree: ``8``, ``8:3`` or ``8:3:deep``: see `tech_tree_of`."""
    name = f"workshop:{spec}"
    return WorkshopTask(replace(tech_tree_of(spec), label=name), name)


def workshop(rules: Rules) -> WorkshopTask:
    """Return a workshop of rules, which can be given wherever a graph or a task can.

    Things that rules need or use are on a shelf; an agent puts them on a bench and works: see `WorkshopWorld`.

    Args:
        rules: the recipes, and the thing to make as their target.

    Examples:
        >>> rules = hierroom.Rules({"log": {"gives": "log"}, "raft": {"uses": "log", "gives": "raft"}}, target="raft")
        >>> env = hierroom.env(hierroom.workshop(rules))
        >>> env.reset(seed=0)
        >>> env.unwrapped.complexity.exit_depth
        1
    """
    if not isinstance(rules, Rules):
        raise InputError(f"a workshop is made of hierroom.Rules, not of {shown(rules)}")
    return WorkshopTask(rules, rules.label)
