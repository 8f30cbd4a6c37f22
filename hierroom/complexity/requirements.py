"""The rules that matter for a target, and the depths of their goals: fixpoints over AND and OR.

Requirements are not always a tree, and they may have cycles: water freezes and ice melts. So the depth of a goal is the
least solution of

    depth(goal) = min over its alternatives of depth(alternative)
    depth(alternative) = 1 + max over what it needs or uses of depth(fact, count)
    depth(fact, count) = 0 if the start has that many, else min over alternatives that give the fact of their depth,

found by iteration from infinity. This assumes that facts that were given once stay, in any count up to their capacity.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from hierroom.goals import Alternative, Rules


def relevant_rules(rules: Rules) -> Rules | None:
    """Return the rules that give the target or a fact that a relevant rule asks for; None if none gives the target."""
    wanted, relevant, n_before = {rules.target}, {}, -1
    while len(relevant) > n_before:
        n_before = len(relevant)
        relevant = {goal: ways for goal, ways in rules.rules.items() if any(wanted & {*way.gives} for way in ways)}
        wanted |= {fact for ways in relevant.values() for way in ways for fact in (*way.needs, *way.uses)}
    facts = {fact for ways in relevant.values() for way in ways for counts in way for fact in counts}
    capacity, start = ({fact: counts[fact] for fact in facts} for counts in (rules.capacity, rules.start))
    return replace(rules, rules=relevant, capacity=capacity, start=start) if relevant else None


def goal_depths(rules: Rules) -> dict[str, float]:
    """Return the depth of each goal: the least number of goals to achieve one after the other, itself included.

    The depth is ``inf`` if the goal is out of reach even when nothing is used up.
    """
    return _depths(rules)[0]


def target_depth(rules: Rules) -> float:
    """Return the least number of goals to achieve one after the other until the target is there."""
    return _depths(rules)[1][rules.target]


def _depths(rules: Rules) -> tuple[dict[str, float], dict[str, float]]:
    goals = dict.fromkeys(rules.names, math.inf)
    facts = dict.fromkeys(rules.facts, math.inf)
    has_changed = True
    while has_changed:
        has_changed = False
        for goal, ways in rules.rules.items():
            for way in ways:
                depth = 1 + max((_fact_depth(rules, facts, *one) for one in required(way).items()), default=0)
                goals[goal] = min(goals[goal], depth)
                for fact in way.gives:
                    if depth < facts[fact]:
                        facts[fact], has_changed = depth, True
    return goals, facts


def links(rules: Rules) -> list[tuple[int, int, bool]]:
    """Return the pairs of rules, by number, where the first gives what the second requires, and if that is used up."""
    found = []
    for first, ways in enumerate(rules.rules.values()):
        given = {fact for way in ways for fact in way.gives}
        for last, others in enumerate(rules.rules.values()):
            if first != last and any(given & {*required(way)} for way in others):
                found.append((first, last, any(given & {*way.uses} for way in others)))
    return found


def required(way: Alternative) -> dict[str, int]:
    """Return the required count of each fact: the larger of the needed and the used count."""
    return {fact: max(way.needs.get(fact, 0), way.uses.get(fact, 0)) for fact in (*way.needs, *way.uses)}


def _fact_depth(rules: Rules, facts: Mapping[str, float], fact: str, count: int) -> float:
    if count <= rules.start[fact]:
        return 0
    return facts[fact] if count <= rules.capacity[fact] else math.inf
