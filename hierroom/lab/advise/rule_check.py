"""Declared rules compared with play: what was achieved without what it needs, and what was never achieved."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import Rules
from hierroom.lab.advise.play import Achieved
from hierroom.lab.advise.played_rules import PlayedRules
from hierroom.support.errors import InputError

MOST = 5_000
"""Most achievements that are compared."""
LEGAL = 100
"""Episodes in which a goal must have been legal before it is called out of reach."""


@dataclass(frozen=True)
class RuleCheck:
    """Compare declared rules with achievements in play.

    Args:
        rules: the rules; None if none were declared.
        played: the rules that play suggests.
        achieved: how often each goal was achieved.
        broken: how often each was achieved although no alternative of its rule applied, and the missing facts.
        unused: goals whose rule would have applied if other rules did not use facts up: uses that do not happen.
        never: goals that were legal in `LEGAL` episodes or more and never achieved, with the number of episodes.
    """

    rules: Rules | None
    played: PlayedRules = field(repr=False)
    achieved: Mapping[str, int]
    broken: Mapping[str, tuple[int, tuple[str, ...]]]
    unused: Mapping[str, int]
    never: Mapping[str, int]

    @cached_property
    def suggested(self) -> Rules | None:
        """The rules as play suggests them; None if play never achieved the target, or they hold."""
        holds = self.rules is not None and not self.broken and not self.unused
        return None if holds or self.played.target not in self.played.ways else self.played.rules

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain types."""
        names = ("achieved", "broken", "unused", "never")
        return {
            **{name: dict(getattr(self, name)) for name in names},
            "suggested": self.suggested and self.suggested.to_dict(),
        }

    def __str__(self) -> str:
        n = sum(self.achieved.values())
        lines = [f"{goal}: legal in {n:,} episodes, and never achieved" for goal, n in self.never.items()]
        for goal, (count, missing) in self.broken.items():
            without = f"without {', '.join(missing)}"
            lines.append(
                f"{goal}: {count:,} of {self.achieved[goal]:,} times achieved {without}{self._as_played(goal)}"
            )
        for goal, count in self.unused.items():
            lines.append(f"{goal}: {count:,} of {self.achieved[goal]:,} times with facts that rules had used up")
        if self.rules is None:
            return "\n".join([f"none declared; measured from {n:,} achievements", *lines])
        return "\n".join(lines) or f"hold in all of {n:,} achievements"

    def _as_played(self, goal: str) -> str:
        ways = [", ".join(way) or "nothing" for way in self.played.ways.get(goal, ())]
        return f"; in play it came after {' or '.join(ways)}" if ways else ""


def check_rules(
    rules: Rules | None,
    episodes: Sequence[Achieved],
    goals: Sequence[str],
    target: str,
    once: Sequence[str] = (),
) -> RuleCheck:
    """Compare rules, with one rule for each goal, with episodes.

    A goal that is true at reset is not achieved there, and gives its fact from the start.

    Args:
        rules: the rules, or None.
        episodes: the achievements of each episode, in order. Those of one step may come in any order.
        goals: names of all goals.
        target: the goal that ends an episode.
        once: goals that count at most once in an episode.
    """
    names = [[goal for _, goal in episode] for _, episode in episodes]
    played = PlayedRules.of(names, goals, target, set(once))
    if rules is None:
        return RuleCheck(None, played, Counter(goal for one in names for goal in one), {}, {}, {})
    achieved: Counter[str] = Counter()
    broken: Counter[str] = Counter()
    unused: Counter[str] = Counter()
    legal: Counter[str] = Counter()
    missing: dict[str, Counter[str]] = {}
    for start, episode in episodes:
        if achieved.total() >= MOST:
            break
        marking = kept = rules.start_marking if start is None else start  # kept: as if nothing were used up
        seen: set[str] = set()
        for _, group in groupby(episode, key=lambda one: one[0]):
            seen |= _legal(rules, marking)
            left = [goal for _, goal in group]
            while left:
                after, applies = rules.apply_all(marking)
                goal = next((one for one in left if applies[rules.names.index(one)]), left[0])
                left.remove(goal)
                rule = rules.names.index(goal)
                achieved[goal] += 1
                given = rules.given[rule, 0]
                if applies[rule]:
                    marking = after[rule]
                else:
                    if rules.apply_all(kept)[1][rule]:
                        unused[goal] += 1
                    else:
                        broken[goal] += 1
                        lacks = np.flatnonzero(kept < rules.required[rule, 0])
                        missing.setdefault(goal, Counter()).update(rules.facts[fact] for fact in lacks)
                    marking = np.minimum(marking + given, rules.limits)
                kept = np.minimum(kept + given, rules.limits)
        legal.update(seen | _legal(rules, marking))
    never = {goal: n for goal, n in legal.items() if n >= LEGAL and not achieved[goal]}
    why = {goal: (n, tuple(missing[goal])) for goal, n in broken.items()}
    return RuleCheck(rules, played, achieved, why, unused, never)


def _legal(rules: Rules, marking: NDArray[np.integer]) -> set[str]:
    after, applies = rules.apply_all(marking)
    changes = applies & (after != marking).any(axis=-1)
    return {name for name, one in zip(rules.names, changes.tolist(), strict=True) if one}


def complete(check: RuleCheck) -> Rules:
    """Return the repaired rules: as declared if they hold, else as play suggests them."""
    if (suggested := check.suggested) is not None:
        return suggested
    if check.rules is None:
        raise InputError(check.played.missed)
    return check.rules
