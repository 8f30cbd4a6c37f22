"""The view of M environments of a simple world, and the description of one of them in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.goals.goal_set import GoalSet
from hierroom.worlds.dependencies import Dependencies
from hierroom.worlds.env_config import SPLITS
from hierroom.worlds.world import Feature


@dataclass(frozen=True)
class GoalInWords:
    """A goal, described for a meta-controller that reads text.

    Args:
        id: its number.
        name: its name.
        is_legal: whether the meta-controller may choose it.
        achieved: how often it was achieved in this episode; in a Workshop, 1 for any number.
    """

    id: int
    name: str
    is_legal: bool
    achieved: int

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True)
class Situated:
    """One environment in words: its ``goals``, the ``steps`` of the episode, and the counts of the rules' ``facts``."""

    goals: tuple[GoalInWords, ...]
    steps: int
    facts: Mapping[str, int]

    @property
    def legal_goals(self) -> tuple[GoalInWords, ...]:
        """The goals that the meta-controller may choose; empty if only 'no goal' is legal."""
        return tuple(goal for goal in self.goals if goal.is_legal)

    def __str__(self) -> str:
        achieved = ", ".join(f"{goal} {goal.achieved} times" for goal in self.goals if goal.achieved) or "nothing"
        legal = ", ".join(map(str, self.legal_goals)) or "none"
        return f"step {self.steps}; achieved: {achieved}; legal goals: {legal}"


@dataclass(frozen=True, eq=False)
class BaseView:
    """The view of M environments, in read-only arrays of its own; the views of other worlds have the same methods.

    Args:
        goals: the goals of their world.
        dependencies: the rules of the goals, or None.
        is_repeatable: which goals may be chosen again: see `BaseWorld.is_repeatable`.
        levels: the set of levels that they draw from.
        entries: their observation entries by name, [M, ...] each.
        counts: [M, G] how often each goal was achieved in the episode.
        markings: [M, F] the count of each fact of the rules.
        steps: [M] steps of the episode.
        episodes: [M, 3] seed, number of the environment and number of the episode.
    """

    goals: GoalSet
    dependencies: Dependencies | None
    is_repeatable: Any
    levels: str | None
    entries: Mapping[str, NDArray]
    counts: NDArray[np.integer]
    markings: NDArray[np.integer]
    steps: NDArray[np.integer]
    episodes: NDArray[np.integer]

    def __post_init__(self) -> None:
        for array in (self.counts, self.markings, self.steps, self.episodes, *self.entries.values()):
            array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.counts)

    def as_dict(self) -> dict[str, NDArray]:
        """Return the observation's entries by name, in fresh arrays."""
        return {name: array.copy() for name, array in self.entries.items()}

    def merged(self, other: BaseView, where: NDArray[np.bool_], rows: NDArray[np.integer]) -> BaseView:
        """Return this view with ``rows`` of another view in the places ``where`` [M]."""

        def mixed(ours: NDArray, theirs: NDArray) -> NDArray:
            ours = ours.copy()
            ours[where] = theirs[rows]
            return ours

        entries = {name: mixed(array, other.entries[name]) for name, array in self.entries.items()}
        names = ("counts", "markings", "steps", "episodes")
        rest = {name: mixed(getattr(self, name), getattr(other, name)) for name in names}
        return replace(self, entries=entries, **rest)

    def uniforms(self, turns: NDArray[np.integer], n: int) -> NDArray[np.float64]:
        """Return [M, n] random numbers in [0, 1), determined by seed, environment, episode and turn [M]."""
        return _uniforms(episode_states(self.episodes, n, SPLITS[self.levels], 1, turns))

    def level(self, m: int, legal: NDArray[np.bool_]) -> Situated:
        """Return the m-th environment as objects that a user's function reads."""
        names, counts = self.goals.names, self.counts[m].tolist()
        goals = [GoalInWords(g, name, bool(legal[g]), counts[g]) for g, name in enumerate(names)]
        rules = self.dependencies
        facts = {} if rules is None else rules.in_words(self.markings[m].tolist())
        return Situated(tuple(goals), int(self.steps[m]), facts)

    @cached_property
    def existing(self) -> NDArray[np.bool_]:
        """Goals left to achieve, [M, G]: not achieved in this episode, or repeatable."""
        return (self.counts == 0) | self.is_repeatable

    @cached_property
    def reachable(self) -> NDArray[np.bool_]:
        """Goals with a rule that applies and changes something, [M, G]; without rules, the goals left to achieve."""
        rules = self.dependencies
        return self.existing if rules is None else rules.reachable(self.markings)

    @property
    def seen(self) -> NDArray[np.bool_]:
        """The same goals as `reachable`, [M, G]."""
        return self.reachable

    @cached_property
    def depth_first_ranks(self) -> NDArray[np.integer]:
        """1 for the next goal on a random depth-first path to the target, else 0: [M, G].

        Without a target, goals that are not achieved yet have their depths. Where none of them is in reach, 1 is for
        the next goal on a path to the deepest one.
        """
        ranks, rules, missing = np.zeros(self.counts.shape, np.int64), self.dependencies, self.counts == 0
        has_target, rows = self.goals.has_target, [*range(len(self))]
        if not has_target:
            ranks += missing * (1 if rules is None else rules.depths)
            rows = np.flatnonzero(~(missing & self.reachable).any(axis=1)).tolist()
        if rules is None:
            return ranks
        drawn = _uniforms(episode_states(self.episodes[rows], rules.n_random, SPLITS[self.levels], 2, 0))
        for m, random in zip(rows, drawn, strict=True):
            marking = self.markings[m]
            goal = (
                rules.next_goal(marking, random) if has_target else rules.next_goal_to_any(marking, missing[m], random)
            )
            if goal is not None:
                ranks[m, goal] = 1
        return ranks


def episode_states(episodes: NDArray[np.integer], n: int, *entropy: Any) -> NDArray[np.uint64]:
    """Return n random numbers of 64 bits [M, n] determined by episodes [M, 3] and entropy: whole numbers, or [M]."""
    columns = (np.broadcast_to(numbers, len(episodes)).tolist() for numbers in (*np.transpose(episodes), *entropy))
    states = [np.random.SeedSequence(row).generate_state(n, np.uint64) for row in zip(*columns, strict=True)]
    return np.array(states, np.uint64).reshape(len(episodes), n)


def _uniforms(states: NDArray[np.uint64]) -> NDArray[np.float64]:
    return (states >> np.uint64(11)) * np.float64(2.0**-53)


def goal_status(n_goals: int) -> Feature:
    """Return a feature with one number for each goal: 1 if it is reachable, plus 2 if it was achieved."""
    return Feature((4,) * n_goals, lambda o: o.view.reachable + 2 * (o.view.counts > 0), is_by_goal=True)
