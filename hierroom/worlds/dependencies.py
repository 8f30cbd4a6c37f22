"""The rules of a world applied to its goals: what has been achieved, what may come next, and a way to the target."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.goals.goal_set import GoalSet
from hierroom.goals.rules import Rules


class DepthFirst:
    """Finds the next goal on a random depth-first way to the target.

    Random numbers order the alternatives and the facts; with the same numbers throughout an episode, the way stays the
    same. Alternatives are dropped in this order as long as the target stays in reach. Then the first missing
    requirement is pursued, and in turn its first missing requirement, down to a rule that applies. A requirement that
    uses up what another one asks for comes after it. If each uses up what the other asks for, the way may never end.

    Args:
        rules: the rules.
    """

    def __init__(self, rules: Rules) -> None:
        self._rules = rules
        counts = rules.n_alternatives.tolist()
        self._ways = [(rule, way) for rule, n in enumerate(counts) for way in range(n)]
        rows = tuple(np.array(self._ways).T)
        self._required, self._given = rules.required[rows], rules.given[rows] > 0  # [W, F]
        self._used = rules.used[rows] > 0
        # An earlier alternative of the same rule may apply wherever this one does.
        earlier = [self._required[row - way : row] <= self._required[row] for row, (_, way) in enumerate(self._ways)]
        is_first = np.array([not one.all(axis=1).any() for one in earlier])
        self._is_possible: NDArray[np.bool_] = np.all(self._required <= rules.limits, axis=1) & is_first
        self._target = rules.facts.index(rules.target)
        self.n_random = len(self._ways) + len(rules.facts)
        """The number of random numbers that an episode needs."""

    def next_rule(self, marking: ArrayLike, random: NDArray[np.floating], target: int | None = None) -> int | None:
        """Return the rule to apply next, or None if the target is there already or no way leads to it.

        Args:
            marking: [F] the count of each fact.
            random: `n_random` numbers that are the same throughout an episode.
            target: the number of a fact; None: the target of the rules.
        """
        have, target = np.asarray(marking), self._target if target is None else target
        kept = self._is_possible.copy()
        if have[target] or self._makers(kept, have)[target] < 0:
            return None
        for way in np.argsort(random[: len(kept)]).tolist():
            kept[way] = False
            kept[way] = self._makers(kept, have)[target] < 0
        makers, order, fact = self._makers(kept, have), np.argsort(random[len(kept) :]).tolist(), target
        while True:  # this ends, because what a maker requires is made before it
            way = int(makers[fact])
            missing = have < self._required[way]
            if not missing.any():
                return self._ways[way][0]
            fact = self._first([one for one in order if missing[one]], makers, have)

    def _first(self, facts: list[int], makers: NDArray[np.integer], have: NDArray[np.integer]) -> int:
        """Return the first of the missing ``facts`` that does not have to come after another one of them."""
        if len(facts) == 1 or not self._used.any():
            return facts[0]
        known: dict[int, NDArray[np.bool_]] = {}
        ways = [self._way_to(fact, makers, have, known) for fact in facts]

        def comes_later(n: int) -> bool:
            others = [way for m, way in enumerate(ways) if m != n]
            return any((ways[n][1] & asked).any() or taken[facts[n]] for asked, taken in others)

        return next((fact for n, fact in enumerate(facts) if not comes_later(n)), facts[0])

    def _way_to(
        self, fact: int, makers: NDArray[np.integer], have: NDArray[np.integer], known: dict[int, NDArray[np.bool_]]
    ) -> NDArray[np.bool_]:
        """Return which facts the way to a fact asks for, and which it uses up: [2, F]; ``known`` keeps all found."""
        if fact not in known:
            way = int(makers[fact])
            found = np.stack([self._required[way] > 0, self._used[way]])
            for one in np.flatnonzero(have < self._required[way]).tolist():
                found |= self._way_to(one, makers, have, known)
            known[fact] = found
        return known[fact]

    def _makers(self, kept: NDArray[np.bool_], have: NDArray[np.integer]) -> NDArray[np.integer]:
        """Return the kept way [F] that first gives each fact, or -1 if none; this assumes that nothing is used up."""
        makers = np.full(len(have), -1)
        while True:
            can_be_taken = kept & ((have >= self._required) | (makers >= 0)).all(axis=1)
            new = (self._given & can_be_taken[:, None]).any(axis=0) & (makers < 0)
            if not new.any():
                return makers
            makers[new] = (self._given & can_be_taken[:, None]).argmax(axis=0)[new]


class Dependencies:
    """Rules that have one rule for each goal of a world.

    Args:
        rules: the rules.
        goals: the goals.
    """

    def __init__(self, rules: Rules, goals: GoalSet) -> None:
        self.rules, self._names = rules, goals.names
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

    @cached_property
    def depths(self) -> NDArray[np.int64]:
        """The depth of each goal [G] (see `requirements.goal_depths`); 0 if it is out of reach."""
        from hierroom.complexity.requirements import goal_depths  # it loads slowly, and few worlds need it

        depths = goal_depths(self.rules)
        return np.array([int(depths[name]) if math.isfinite(depths[name]) else 0 for name in self._names])

    def next_goal_to_any(
        self, marking: NDArray[np.integer], missing: NDArray[np.bool_], random: NDArray[np.floating]
    ) -> int | None:
        """Return the next goal on a random depth-first path to the deepest of the ``missing`` goals, [G] bool."""
        for goal in sorted(np.flatnonzero(missing).tolist(), key=lambda goal: -self.depths[goal]):
            for fact in np.flatnonzero(self.rules.given[self._rule_of_goal[goal], 0]).tolist():
                if (rule := self._search.next_rule(marking, random, fact)) is not None:
                    return self._goal_of_rule[rule]
        return None

    def in_words(self, marking: Sequence[int]) -> dict[str, int]:
        """Return the count of each fact."""
        return dict(zip(self.rules.facts, marking, strict=True))


def rules_by_goal(rules: Rules) -> dict[str, Rules]:
    """Return the same rules once for each goal, with that goal as the target."""
    return {goal: replace(rules, target=goal, label=f"{rules.name}, {goal}") for goal in rules.names}
