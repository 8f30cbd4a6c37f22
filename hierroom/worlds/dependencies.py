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

    def at_start(self, times: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the markings [M, F] of episodes that begin with goals achieved ``times`` [M, G] already."""
        given, limits = self.rules.given[self._rule_of_goal, 0], self.rules.limits
        return np.minimum(self.rules.start_marking + np.minimum(times, limits.max()) @ given, limits)

    def apply(self, markings: NDArray[np.integer], times: NDArray[np.integer]) -> None:
        """Update markings [N, F] by goals achieved ``times`` [N, G].

        Of goals that one step achieved, those with a rule that applies come first; the others count all the same.
        """
        for env in np.flatnonzero(times.any(axis=1)).tolist():
            goals = np.flatnonzero(times[env])
            left = dict(zip(self._rule_of_goal[goals].tolist(), times[env, goals].tolist(), strict=True))
            while left:
                after, applies = self.rules.apply_all(markings[env])
                rule = next((one for one in left if applies[one]), next(iter(left)))
                forced = np.minimum(markings[env] + self.rules.given[rule, 0], self.rules.limits)
                now = after[rule] if applies[rule] else forced
                left[rule] -= 1
                if left[rule] <= 0 or (now == markings[env]).all():
                    del left[rule]
                markings[env] = now

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
