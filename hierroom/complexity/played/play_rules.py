"""Rules estimated from play: what had been achieved before a goal was, whenever it was."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from hierroom.goals.rules import Rules
from hierroom.support.errors import InputError

Needs = dict[str, int]
"""The number of times that each goal must have been achieved."""
MAX_ALTERNATIVES = 4


@dataclass(frozen=True)
class PlayedRules:
    """Dependencies of goals as far as play shows them: an upper bound of the true needs.

    What had been achieved before *every* first achievement of a goal may be needed for it; what was missing once is
    not. Where nothing less was ever enough in any single episode, the goal has alternatives: of the smallest sets that
    were enough, the fewest that explain all episodes. A requirement that another one has itself is left out.

    Args:
        episodes: how many were played.
        seen: in how many of them each goal was achieved, by its name.
        ways: for each goal that was achieved its alternatives.
        target: the goal that ends an episode with success.
    """

    episodes: int
    seen: Mapping[str, int]
    ways: Mapping[str, tuple[Needs, ...]]
    target: str

    @classmethod
    def of(
        cls, episodes: Iterable[Sequence[str]], goals: Sequence[str], target: str, once: Collection[str] = ()
    ) -> PlayedRules:
        """Estimate the rules of goals from episodes, each the names of the goals that it achieved, in their order.

        Goals ``once`` are achieved or not, and are not counted: a second time adds nothing.
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
        return cls(n_episodes, {goal: len(contexts) for goal, contexts in before.items()}, reduced, target)

    @property
    def never(self) -> tuple[str, ...]:
        """The goals that were never achieved: nothing is known of them."""
        return tuple(goal for goal, n in self.seen.items() if not n)

    @cached_property
    def rules(self) -> Rules:
        """The rules of the goals that were achieved; each gives itself, and nothing is used up."""
        if self.target not in self.ways:
            raise InputError(
                f"the target {self.target!r} was never achieved in {self.episodes:,} episodes of play, so no rules "
                "lead to it; play more episodes, or let a trained run play"
            )
        capacity: dict[str, int] = {}
        for way in (way for alternatives in self.ways.values() for way in alternatives):
            capacity |= {goal: max(n, capacity.get(goal, 1)) for goal, n in way.items()}
        rules = {
            goal: [{**({"needs": way} if way else {}), "gives": goal} for way in alternatives]
            for goal, alternatives in self.ways.items()
        }
        return Rules(rules, self.target, capacity, label="from play")

    def __str__(self) -> str:
        rows = [("goal", "seen", "before it, always (an upper bound of what is needed)")]
        for goal, n in self.seen.items():
            ways = " or ".join(_words(way) for way in self.ways.get(goal, ())) or "never achieved"
            rows.append((goal, f"{n:,}", ways))
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = [f"  {goal:<{widths[0]}}  {n:>{widths[1]}}  {ways}".rstrip() for goal, n, ways in rows]
        return "\n".join([f"rules from {self.episodes:,} episodes of play", *lines])


def _smallest(contexts: list[Counter[str]]) -> tuple[Needs, ...]:
    """Return the fewest smallest counts such that each context has at least one of them."""
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
    """Leave out what another requirement has in all its alternatives itself."""

    def is_implied(goal: str, n: int) -> bool:
        others = [ways[other] for other in way if other != goal and other in ways]
        return any(min(one.get(goal, 0) for one in alternatives) >= n for alternatives in others)

    return {goal: n for goal, n in way.items() if not is_implied(goal, n)}


def _words(way: Needs) -> str:
    return ", ".join(goal if n == 1 else f"{n} {goal}" for goal, n in way.items()) or "nothing"
