"""Rules in plain Python by their definition, to which the marking chain is compared."""

from collections import Counter

import numpy as np

from hierroom import Rules

TUNNEL = Rules(
    {
        "wood": {"gives": "wood"},
        "table": {"uses": {"wood": 2}, "gives": "table"},
        "pickaxe": {"needs": "table", "uses": {"wood": 1}, "gives": "pickaxe"},
        "stone": {"needs": "pickaxe", "gives": "stone"},
        "tunnel": [{"needs": {"stone": 3}, "gives": "way"}, {"needs": "dynamite", "gives": "way"}],
    },
    target="way",
    capacity={"wood": 3, "stone": 3},
    label="tunnel",
)


def relevant(rules):
    """Return the goals that give the target, or a fact that such a goal needs or uses."""
    wanted, goals = {rules.target}, set()
    for _ in rules.names:
        for goal, ways in rules.rules.items():
            if any(fact in wanted for way in ways for fact in way.gives):
                goals.add(goal)
                wanted |= {fact for way in ways for fact in (*way.needs, *way.uses)}
    return [goal for goal in rules.names if goal in goals]


def after(rules, goal, marking):
    """Return the marking after a rule, as a Counter, or None where it does not apply or changes nothing."""
    for way in rules.rules[goal]:
        if all(marking[f] >= n for f, n in way.needs.items()) and all(marking[f] >= n for f, n in way.uses.items()):
            changed = Counter(marking)
            changed.subtract(way.uses)
            changed.update(way.gives)
            changed = Counter({fact: min(n, rules.capacity[fact]) for fact, n in changed.items() if n})
            return None if changed == +Counter(marking) else changed
    return None


def unroll(rules):
    """Return for each node, a frozenset of counted facts or the target's name, its moves, the start first."""
    begin = Counter({fact: n for fact, n in rules.start.items() if n})
    goals = relevant(rules)
    named = {fact for goal in goals for way in rules.rules[goal] for facts in way for fact in facts}
    begin = Counter({fact: n for fact, n in begin.items() if fact in named})
    moves, waiting = {}, [begin]
    for marking in waiting:
        node = frozenset(marking.items())
        if node in moves:
            continue
        moves[node] = []
        for goal in goals:
            changed = after(rules, goal, marking)
            if changed is not None and changed[rules.target]:
                moves[node].append(rules.target)
            elif changed is not None:
                moves[node].append(frozenset(changed.items()))
                waiting.append(changed)
    moves[rules.target] = []
    return moves


def matrix(moves):
    """Return W [n, n], with the nodes in the order of ``moves``."""
    index = {node: i for i, node in enumerate(moves)}
    weights = np.zeros((len(moves), len(moves)))
    for node, successors in moves.items():
        for successor in successors:
            weights[index[node], index[successor]] += 0.19 / len(successors)
        if index[node]:
            weights[index[node], 0] += 0.01
    return weights


def random_rules(seed):
    """Return a few rules over a few facts, with alternatives, counts, capacities and a start."""
    rng = np.random.default_rng(seed)
    facts = list("abcd")[: rng.integers(2, 5)]

    def counts(least, most):
        chosen = rng.choice(facts, min(int(rng.integers(least, most + 1)), len(facts)), replace=False)
        return {str(fact): int(rng.integers(1, 3)) for fact in chosen}

    def ways(number):
        return [{"needs": counts(0, 1), "uses": counts(0, 1), "gives": counts(1, 2)} for _ in range(number)]

    rules = {f"rule {n}": ways(rng.integers(1, 3)) for n in range(rng.integers(2, 6))}
    rules |= {"first": [{"gives": facts[0]}], "last": [{"needs": counts(1, 2), "gives": "t"}]}
    every = {fact for ways in rules.values() for way in ways for named in way.values() for fact in named}
    capacity = {fact: int(rng.integers(1, 4)) for fact in facts if fact in every}
    start = {fact: int(rng.integers(0, n + 1)) for fact, n in capacity.items() if rng.random() < 0.5}
    return Rules(rules, "t", capacity, start)
