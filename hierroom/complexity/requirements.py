"""The rules that matter for a target, and the depths of their goals: fixpoints over AND and OR.

Requirements are not always a tree, and they may have cycles: water freezes and ice melts. So the depth of a goal is the
least solution of

    depth(goal) = min over its alternatives of depth(alternative)
    depth(alternative) = 1 + max over what it needs or uses of depth(fact, count)
    depth(fact, count) = 0 if the start has that many, else min over alternatives that give the fact of their depth,

found depth by depth. This assumes that facts that were given once stay, in any count up to their capacity.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import replace

from hierroom.goals import Alternative, Rules


def relevant_rules(rules: Rules) -> Rules | None:
    """Return the rules that give the target or a fact that a relevant rule asks for; None if none gives the target."""
    givers: dict[str, list[str]] = defaultdict(list)
    for goal, ways in rules.rules.items():
        for fact in {fact for way in ways for fact in way.gives}:
            givers[fact].append(goal)
    found, wanted, left = set(), {rules.target}, [rules.target]
    while left:
        for goal in givers[left.pop()]:
            if goal not in found:
                found.add(goal)
                asked = {fact for way in rules.rules[goal] for fact in (*way.needs, *way.uses)} - wanted
                wanted |= asked
                left += asked
    relevant = {goal: ways for goal, ways in rules.rules.items() if goal in found}
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
    goals, facts = dict.fromkeys(rules.names, math.inf), dict.fromkeys(rules.facts, math.inf)
    waiting: dict[str, list[int]] = defaultdict(list)  # for each fact the alternatives that wait for it
    ways = [(goal, way) for goal, ways in rules.rules.items() for way in ways]
    missing: list[float] = []  # for each alternative the number of facts that it waits for
    for n, (_, way) in enumerate(ways):
        asked = {fact: count for fact, count in required(way).items() if count > rules.start[fact]}
        for fact in asked:
            waiting[fact].append(n)
        is_possible = all(count <= rules.capacity[fact] for fact, count in asked.items())
        missing.append(len(asked) if is_possible else math.inf)
    depth, ready = 0, [n for n, number in enumerate(missing) if not number]
    while ready:
        depth, now, ready = depth + 1, ready, []
        for goal, way in map(ways.__getitem__, now):
            goals[goal] = min(goals[goal], depth)
            for fact in way.gives:
                if facts[fact] == math.inf:
                    facts[fact] = depth
                    for n in waiting[fact]:
                        missing[n] -= 1
                        ready += [n] if not missing[n] else []
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
