"""Depth-first ways to the target of rules."""

import numpy as np

from hierroom.goals.depth_first import DepthFirst
from hierroom.goals.rules import Rules

TOOLS = Rules(
    {
        "wood": {"gives": "wood"},
        "table": {"uses": {"wood": 2}, "gives": "table"},
        "pickaxe": {"needs": "table", "uses": "wood", "gives": "pickaxe"},
        "stone": {"needs": "pickaxe", "gives": "stone"},
        "flower": {"gives": "flower"},
        "bomb": {"needs": "flower", "gives": "bomb"},
        "tunnel": [{"needs": {"stone": 2}, "gives": "way"}, {"uses": "bomb", "gives": "way"}],
    },
    target="way",
    capacity={"wood": 2, "stone": 2},
)
DIGGING = ["wood", "wood", "table", "wood", "pickaxe", "stone", "stone", "tunnel"]


def walk(rules, seed):
    """The goals of a whole way, with the same random numbers throughout."""
    search, marking, goals = DepthFirst(rules), rules.start_marking, []
    random = np.random.default_rng(seed).random(search.n_random)
    while (rule := search.next_rule(marking, random)) is not None:
        goals.append(rules.names[rule])
        marking = rules.apply(goals[-1], marking)
    return goals


def test_a_way_follows_one_alternative_to_the_target_and_nothing_else():
    ways = {tuple(walk(TOOLS, seed)) for seed in range(40)}
    assert ways == {tuple(DIGGING), ("flower", "bomb", "tunnel")}


def test_independent_requirements_come_in_any_order_but_each_with_its_own_first():
    rules = Rules(
        {
            **{f"key {n}": {"gives": f"key {n}"} for n in (1, 2)},
            **{f"door {n}": {"needs": f"key {n}", "gives": f"door {n}"} for n in (1, 2)},
            "exit": {"needs": ["door 1", "door 2"], "gives": "exit"},
        },
        "exit",
    )
    first = ["key 1", "door 1", "key 2", "door 2", "exit"]
    second = ["key 2", "door 2", "key 1", "door 1", "exit"]
    assert {tuple(walk(rules, seed)) for seed in range(40)} == {tuple(first), tuple(second)}


def test_a_circle_of_rules_is_not_followed():
    rules = Rules(
        {
            "melt": {"needs": "ice", "gives": "water"},
            "freeze": {"needs": "water", "gives": "ice"},
            "well": {"gives": "water"},
            "skate": {"needs": "ice", "gives": "fun"},
        },
        "fun",
    )
    assert {tuple(walk(rules, seed)) for seed in range(20)} == {("well", "freeze", "skate")}


def test_there_is_no_next_goal_where_the_target_is_there_or_out_of_reach():
    search, marking = DepthFirst(TOOLS), TOOLS.start_marking
    marking[TOOLS.facts.index("way")] = 1
    assert search.next_rule(marking, np.zeros(search.n_random)) is None
    stuck = Rules({"a": {"needs": "b", "gives": "a"}}, "a")
    assert DepthFirst(stuck).next_rule(stuck.start_marking, np.zeros(3)) is None
