"""The report on how hard rules are to explore."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hierroom.complexity.chains.chain import Chain
from hierroom.complexity.chains.hitting import passage_time_sensitivity
from hierroom.complexity.chains.walk import PAPER_WALK, Walk
from hierroom.complexity.markings import MarkingGraph
from hierroom.complexity.requirements import goal_depths, target_depth
from hierroom.complexity.walk_report import WalkReport
from hierroom.goals import Rules

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NAMED = 5
"""Number of names in a line of the report."""


@dataclass(frozen=True)
class RulesReport(WalkReport):
    """Depth, width, dead ends and passage times of rules; created by `analyze`.

    The walk is on the marking chain; its exit is the node of all markings that have the target. The goals of
    `expected_steps_to` and `reach_probability` are facts; those of `goal_sensitivity` are rules.

    Examples:
        >>> rules = hierroom.Rules({"wood": {"gives": "wood"}, "raft": {"uses": "wood", "gives": "raft"}}, "raft")
        >>> report = hierroom.complexity.analyze(rules)
        >>> report.exit_depth, report.fewest, round(report.expected_steps, 1)
        (1, 2, 10.8)
    """

    rules: Rules
    walk: Walk = PAPER_WALK

    def __post_init__(self) -> None:
        _ = self.unrolled.markings  # raises an error if there are too many

    @cached_property
    def unrolled(self) -> MarkingGraph:
        """The rules that matter, unrolled over the counts of their facts."""
        return MarkingGraph(self.rules, self.walk)

    @cached_property
    def chain(self) -> Chain:
        """The walk on the markings, which computes all other quantities."""
        return Chain(self.unrolled.weights, self.unrolled.labels, self.unrolled.start, self.unrolled.achieved)

    @property
    def name(self) -> str:
        """The label of the rules."""
        return self.rules.name

    @cached_property
    def goal_depths(self) -> dict[str, float]:
        """The depth of each goal that matters, see `requirements.goal_depths`."""
        return goal_depths(self.unrolled.relevant) if self.unrolled.relevant else {}

    @property
    def exit_depth(self) -> float:
        """Number of goals that must be achieved one after the other before the target; ``inf`` if out of reach."""
        relevant = self.unrolled.relevant
        return target_depth(relevant) - 1 if relevant and math.isfinite(self.fewest) else math.inf

    @property
    def width(self) -> int:
        """Largest number of goals of the same depth that matter for the target and do not give it."""
        target, rules = self.rules.target, self.rules.rules
        gives = {goal: any(target in way.gives for way in ways) for goal, ways in rules.items()}
        before = [depth for goal, depth in self.goal_depths.items() if not gives[goal]]
        return max(Counter(depth for depth in before if math.isfinite(depth)).values(), default=0)

    @property
    def fewest(self) -> float:
        """Fewest goals to achieve, repeats included, until the target is there; ``inf`` if out of reach."""
        return self.unrolled.fewest

    @property
    def edges(self) -> int:
        """Number of moves between markings, without restarts."""
        return len(self.unrolled.edges)

    @property
    def left_out(self) -> tuple[str, ...]:
        """The goals that do not matter for the target."""
        return tuple(goal for goal in self.rules.names if goal not in self.unrolled.goals)

    @property
    def never(self) -> tuple[str, ...]:
        """The goals that matter for the target and can never be achieved."""
        applied = {*np.unique(self.unrolled.edge_goals).tolist()}
        return tuple(goal for n, goal in enumerate(self.unrolled.goals) if n not in applied)

    @property
    def dead_ends(self) -> tuple[str, ...]:
        """The markings from which the target cannot be reached without a restart."""
        return tuple(self.unrolled.labels[node] for node in self.unrolled.dead_ends)

    @property
    def dead_end_share(self) -> float:
        """Share of the markings that are dead ends."""
        return len(self.unrolled.dead_ends) / len(self.unrolled.markings)

    def goal_sensitivity(self) -> dict[str, float]:
        """Return the percent change of `expected_steps` if a goal gets one percent easier, the bottleneck first.

        This is the sum of the elasticities of the edges that achieve the goal. Empty if the target is out of reach.
        """
        if np.isinf(self.expected_steps):
            return {}
        weights, unrolled = self.chain.weights, self.unrolled
        slopes = passage_time_sensitivity(weights, unrolled.start, unrolled.exit)
        sources, ends = unrolled.edges.T
        chances = self.walk.move / np.bincount(sources, minlength=self.nodes)[sources]
        elasticities = np.asarray(slopes[sources, ends]).ravel() * chances / self.expected_steps
        sums = np.bincount(unrolled.edge_goals, elasticities, minlength=len(unrolled.goals))
        return dict(sorted(zip(unrolled.goals, sums.tolist(), strict=True), key=lambda item: item[1]))

    def described(self) -> dict[str, Any]:
        """Return a description of the rules, as plain types."""
        return {"rules": self.name, "target": self.rules.target, "capacity": self._capacity, "start": self._start}

    def to_dict(self) -> dict[str, Any]:
        """Return the whole report as plain numbers, strings, lists and dicts."""
        of_rules = {
            "goals": self.goal_depths,
            "left_out": list(self.left_out),
            "never": list(self.never),
            "fewest": self.fewest,
            "dead_ends": list(self.dead_ends),
            "dead_end_share": self.dead_end_share,
        }
        return {**super().to_dict(), **of_rules}

    @property
    def _capacity(self) -> dict[str, int]:
        return {fact: self.rules.capacity[fact] for fact in self.unrolled.facts}

    @property
    def _start(self) -> dict[str, int]:
        return {fact: self.rules.start[fact] for fact in self.unrolled.facts if self.rules.start[fact]}

    _reached_by = "target there by"

    @property
    def _head(self) -> str:
        return f"{self.name}: {len(self.rules.names)} rules, target {self.rules.target}"

    def _first_lines(self) -> list[tuple[str, str]]:
        several = {fact: count for fact, count in self._capacity.items() if count > 1}
        n_dead, n = len(self.dead_ends), len(self.unrolled.markings)
        dead = f"{n_dead} of {n} markings ({self.dead_end_share:.1%}): {_named(self.dead_ends, '; ')}"
        lines = [
            ("capacity", _counts(several) + ("; 1 of every other fact" if several else "1 of every fact")),
            ("start", _counts(self._start) or "nothing"),
            ("exit depth", f"{self.exit_depth:.0f}   (goals one after the other before {self.rules.target})"),
            ("width", f"{self.width}"),
            ("fewest", f"{self.fewest:.0f}   (goals to achieve, the last gives {self.rules.target})"),
            ("marking chain", f"{self.nodes} nodes, {self.edges} edges"),
            ("dead ends", dead if n_dead else "none"),
        ]
        if self.left_out:
            lines.insert(0, ("left out", f"{_named(self.left_out)}   (they do not help to get {self.rules.target})"))
        if self.never:
            lines.append(("out of reach", f"{_named(self.never)}   (what they need is never there)"))
        return lines

    def _figure(self) -> Figure:
        from hierroom.complexity.draw import figure_of_rules

        return figure_of_rules(self.unrolled.relevant or self.rules)


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{fact} {count}" for fact, count in counts.items())


def _named(names: tuple[str, ...], between: str = ", ") -> str:
    return between.join(names[:NAMED]) + f"{between}..." * (len(names) > NAMED)
