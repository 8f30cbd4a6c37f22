"""The rules of a world applied to its goals: what has been achieved, what may come next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.goals.depth_first import DepthFirst
from hierroom.goals.goal_set import GoalSet
from hierroom.goals.rules import Rules


class Dependencies:
    """Rules that have one rule for each goal of a world.

    Args:
        rules: the rules.
        goals: the goals.
    """

    def __init__(self, rules: Rules, goals: GoalSet) -> None:
        self.rules = rules
        self._rule_of_goal = np.array([rules.names.index(name) for name in goals.names])
        self._goal_of_rule = [goals.names.index(name) for name in rules.names]
        self._search = DepthFirst(rules)
        self.n_random = self._search.n_random
        """Number of random numbers that `next_goal` takes."""

    @classmethod
    def of(cls, rules: Any, goals: GoalSet) -> Dependencies | None:
        """Return the dependencies of a world, or None if it has no `Rules`."""
        return cls(rules, goals) if isinstance(rules, Rules) else None

    def apply(self, markings: NDArray[np.integer], times: NDArray[np.integer]) -> None:
        """Update markings [N, F] by goals achieved ``times`` [N, G]; a goal counts even if its rule does not apply."""
        for env, goal in np.argwhere(times).tolist():
            rule = self._rule_of_goal[goal]
            for _ in range(int(times[env, goal])):
                after, applies = self.rules.apply_all(markings[env])
                forced = np.minimum(markings[env] + self.rules.given[rule, 0], self.rules.limits)
                markings[env] = after[rule] if applies[rule] else forced

    def reachable(self, markings: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Return the goals [M, G] with a rule that applies to a marking [M, F] and changes something."""
        after, applies = self.rules.apply_all(markings)
        changes = (after != markings[:, None, :]).any(axis=-1)
        return (applies & changes)[:, self._rule_of_goal]

    def next_goal(self, marking: NDArray[np.integer], random: NDArray[np.floating]) -> int | None:
        """Return the next goal on a random depth-first path to the target: see `DepthFirst`."""
        rule = self._search.next_rule(marking, random)
        return None if rule is None else self._goal_of_rule[rule]

    def in_words(self, marking: Sequence[int]) -> dict[str, int]:
        """Return the count of each fact."""
        return dict(zip(self.rules.facts, marking, strict=True))
