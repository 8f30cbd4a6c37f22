"""Rules estimated from play: a goal may need what was always achieved before it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from hierroom.goals.rules import Rules
from hierroom.support.errors import InputError

Needs = dict[str, int]
"""For each goal, how many times it must have been achieved."""
MAX_ALTERNATIVES = 4


@dataclass(frozen=True)
class PlayedRules:
    """Dependencies of goals as far as play shows them: an upper bound of the true needs.

    A goal may need what was achieved before *every* first achievement of it, but not what was missing once. If these
    common achievements alone never sufficed, the goal gets alternatives: the fewest of the smallest sufficient sets
    that explain all episodes. A requirement that another requirement already has is left out.

    Args:
        episodes: number of episodes played.
        ways: the alternatives of each goal that was achieved.
        target: the goal that ends an episode with success.
    """

    episodes: int
    ways: Mapping[str, tuple[Needs, ...]]
    target: str

    @classmethod
    def of(
        cls, episodes: Iterable[Sequence[str]], goals: Sequence[str], target: str, once: Collection[str] = ()
    ) -> PlayedRules:
        """Estimate the rules of goals from episodes, each given as the names of its achieved goals, in their order.

        The goals in ``once`` count at most once in an episode.
        """
        before: dict[str, list[Counter[str]]] = {goal: [] for goal in goals}
        n_episodes = 0
        for achieved in episodes:
            n_episodes += 1
            so_far: Counter[str] = Counter()
            for goal in achieved:
                if goal not in so_far:
                    before[goal].append(so_far.copy())
                so_far[goal] = 1 if goal in once else so_far[goal] + 1
        ways = {goal: _smallest(contexts) for goal, contexts in before.items() if contexts}
        reduced = {goal: tuple(_reduced(way, ways) for way in alternatives) for goal, alternatives in ways.items()}
        return cls(n_episodes, reduced, target)

    @cached_property
    def rules(self) -> Rules:
        """The rules of the achieved goals. Each gives a fact of its own name, and nothing is used up."""
        if self.target not in self.ways:
            raise InputError(self.missed)
        capacity: dict[str, int] = {}
        for way in (way for alternatives in self.ways.values() for way in alternatives):
            capacity |= {goal: max(n, capacity.get(goal, 1)) for goal, n in way.items()}
        rules = {
            goal: [{**({"needs": way} if way else {}), "gives": goal} for way in alternatives]
            for goal, alternatives in self.ways.items()
        }
        return Rules(rules, self.target, capacity, label="from play")

    @property
    def missed(self) -> str:
        """A line that says that the target was never achieved, and what to do."""
        played = f"{self.episodes:,} episodes of play"
        return f"the target {self.target!r} was never achieved in {played}, so no rules lead to it; play longer"


def _smallest(contexts: list[Counter[str]]) -> tuple[Needs, ...]:
    """Return few minimal counts such that each context has at least one of them, else the counts common to all."""
    distinct = [dict(one) for one in {tuple(sorted(context.items())) for context in contexts}]
    common = {goal: min(context[goal] for context in contexts) for goal in contexts[0]}
    common = {goal: n for goal, n in common.items() if n}
    if common in distinct:
        return (common,)
    smallest = [one for one in distinct if not any(other != one and _is_within(other, one) for other in distinct)]
    chosen, left = [], contexts
    while left and len(chosen) < MAX_ALTERNATIVES:
        covered = {n: sum(_is_within(way, context) for context in left) for n, way in enumerate(smallest)}
        best = max(covered, key=lambda n: (covered[n], -sum(smallest[n].values()), sorted(smallest[n])))
        chosen.append(smallest[best])
        left = [context for context in left if not _is_within(smallest[best], context)]
    return tuple(chosen) if not left else (common,)


def _is_within(needs: Mapping[str, int], context: Mapping[str, int]) -> bool:
    return all(context.get(goal, 0) >= n for goal, n in needs.items())


def _reduced(way: Needs, ways: Mapping[str, tuple[Needs, ...]]) -> Needs:
    """Leave out what all alternatives of another requirement already need."""

    def is_implied(goal: str, n: int) -> bool:
        others = [ways[other] for other in way if other != goal and other in ways]
        return any(min(one.get(goal, 0) for one in alternatives) >= n for alternatives in others)

    return {goal: n for goal, n in way.items() if not is_implied(goal, n)}
