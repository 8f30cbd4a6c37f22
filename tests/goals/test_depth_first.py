"""Depth-first ways to the target of rules."""

import numpy as np
import pytest

from hierroom.goals.rules import Rules
from hierroom.worlds.dependencies import DepthFirst

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
    """Return the goals of one way, at most 50; the random numbers stay the same throughout."""
    search, marking, goals = DepthFirst(rules), rules.start_marking, []
    random = np.random.default_rng(seed).random(search.n_random)
    while len(goals) < 50 and (rule := search.next_rule(marking, random)) is not None:
        goals.append(rules.names[rule])
        marking = rules.apply(goals[-1], marking)
    return goals


def test_depth_first_follows_one_alternative_to_the_target():
    ways = {tuple(walk(TOOLS, seed)) for seed in range(40)}
    assert ways == {tuple(DIGGING), ("flower", "bomb", "tunnel")}


def test_independent_requirements_come_in_random_order():
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


def test_cyclic_rules_are_not_followed():
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


HANDS = Rules(
    {
        "pick key": {"uses": "hands", "gives": "key"},
        "drop key": {"uses": "key", "gives": "hands"},
        "unlock": {"needs": "key", "gives": "open"},
        "pick box": {"needs": "open", "uses": "hands", "gives": "box"},
    },
    "box",
    start={"hands": 1},
)
PHOTO = Rules(
    {
        "on": {"uses": "dark", "gives": "light"},
        "off": {"uses": "light", "gives": "dark"},
        "photo": {"needs": "light", "gives": "photo"},
        "leave": {"needs": ["photo", "dark"], "gives": "left"},
    },
    "left",
    start={"dark": 1},
)


@pytest.mark.parametrize(
    ("rules", "way"),
    [(HANDS, ("pick key", "unlock", "drop key", "pick box")), (PHOTO, ("on", "photo", "off", "leave"))],
)
def test_rule_that_removes_a_needed_fact_comes_later(rules, way):
    """In any other order the way would never end."""
    assert {tuple(walk(rules, seed)) for seed in range(20)} == {way}


def test_alternative_beyond_the_capacity_is_never_taken():
    rules = Rules(
        {
            "a": {"gives": "a"},
            "b": {"gives": "b"},
            "t": [{"needs": {"a": 2}, "gives": "t"}, {"needs": "b", "gives": "t"}],
        },
        "t",
    )
    assert {tuple(walk(rules, seed)) for seed in range(20)} == {("b", "t")}


def test_next_rule_is_none_for_reached_or_unreachable_target():
    search, marking = DepthFirst(TOOLS), TOOLS.start_marking
    marking[TOOLS.facts.index("way")] = 1
    assert search.next_rule(marking, np.zeros(search.n_random)) is None
    stuck = Rules({"a": {"needs": "b", "gives": "a"}}, "a")
    assert DepthFirst(stuck).next_rule(stuck.start_marking, np.zeros(3)) is None


def test_depth_first_follows_shared_ingredients_once():
    links = {f"{n}": {"uses": [f"{n - 1}", f"{n - 2}"], "gives": f"{n}"} for n in range(2, 60)}
    rules = Rules({"0": {"gives": "0"}, "1": {"gives": "1"}, **links}, "59")
    search = DepthFirst(rules)
    assert search.next_rule(rules.start_marking, np.zeros(search.n_random)) in (0, 1)


def test_an_alternative_behind_an_earlier_one_is_no_way():
    chest = [{"gives": "dust"}, {"needs": "key", "gives": "gold"}]
    rules = Rules({"key": {"gives": "key"}, "chest": chest, "dig": {"needs": "dust", "gives": "gold"}}, "gold")
    for seed in range(10):
        assert walk(rules, seed) == ["chest", "dig"]
    assert walk(Rules({"key": {"gives": "key"}, "chest": chest}, "gold"), 0) == []
