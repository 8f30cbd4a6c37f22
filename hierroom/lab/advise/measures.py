"""Measures of a task before training, each by one function with its equation. `model` says which predicts what."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from hierroom.complexity.report import analyze
from hierroom.goals import GoalGraph, Rules
from hierroom.lab.advise.costs import PlayCosts
from hierroom.support.errors import InputError


@dataclass(frozen=True)
class Known:
    """Hold the facts known of a task before training; ``nan`` where one is not known.

    Args:
        expected_steps: E, mean random steps to the target, see `stages`.
        cost: the sum over kinds of goal of the mean random steps to a given goal of that kind.
        kinds: number of kinds of goal that the script gives: goals of the same kind in the goal set, for which the
            controller can share a skill. In EscapeRooms key, door and exit; elsewhere each goal is a kind.
        fewest: fewest goals of a solution, from the rules.
        markings: nodes of the marking chain of the rules.
        goals: number of goals on the way to the target.
        limit: steps of an episode.
        random_success: share of episodes in which random play reaches the target.
    """

    expected_steps: float
    cost: float
    kinds: int
    fewest: float
    markings: float
    goals: int
    limit: int
    random_success: float = math.nan

    @classmethod
    def of(cls, costs: PlayCosts, rules: Rules | GoalGraph | None) -> Known:
        """Return what play and rules show of a task."""
        steps = [goal.steps.value for goal in costs.goals.values()]
        fewest, markings, goals = rule_numbers(rules)
        numbers = fewest, markings, goals, costs.limit, costs.random_success.value
        return cls(costs.expected_steps.value, sum(steps), len(steps), *numbers)


def rule_numbers(rules: Rules | GoalGraph | None) -> tuple[float, float, int]:
    """Return the fewest goals of a solution, the markings and the number of rules; ``nan`` without rules."""
    if rules is None:
        return math.nan, math.nan, 0
    of_rules = rules.rules() if isinstance(rules, GoalGraph) else rules
    report = analyze(of_rules)
    try:
        return report.fewest, float(report.nodes), len(of_rules.names)
    except InputError:  # more markings than can be unrolled
        return math.nan, math.inf, len(of_rules.names)


MEASURES: Mapping[str, Callable[[Known], float]] = {
    "W": lambda known: known.cost * known.fewest,
    "W x kinds": lambda known: known.cost * known.fewest * known.kinds,
}
"""The measures that predict; `benchmarks.prediction` compares them with others.

- W: the random steps of all skills, times the goals in a row that a solution needs
- W x kinds: each kind of goal is a skill to learn"""
