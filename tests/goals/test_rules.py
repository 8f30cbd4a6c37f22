"""Rules: errors for invalid ones, files, how a rule changes a marking, and depth-first ways to their target."""

import pickle

import numpy as np
import pytest
from plain_rules import TUNNEL

import hierroom
from hierroom import InputError, Rules
from hierroom.worlds.dependencies import DepthFirst

A = {"a": {"gives": "x"}}


def test_rules_have_names_facts_and_arrays():
    assert TUNNEL.names == ("wood", "table", "pickaxe", "stone", "tunnel")
    assert TUNNEL.facts == ("wood", "table", "pickaxe", "stone", "way", "dynamite")
    assert TUNNEL.capacity == {"wood": 3, "table": 1, "pickaxe": 1, "stone": 3, "way": 1, "dynamite": 1}
    assert TUNNEL.required.shape == TUNNEL.used.shape == TUNNEL.given.shape == (5, 2, 6)
    assert TUNNEL.n_alternatives.tolist() == [1, 1, 1, 1, 2]
    assert TUNNEL.start_marking.tolist() == [0] * 6
    assert Rules({"a": {"needs": ["x", "y"], "uses": ["x", "x"], "gives": "y"}}, "y").rules["a"] == (
        ({"x": 1, "y": 1}, {"x": 2}, {"y": 1}),
    )


def test_apply_uses_facts_and_gives_up_to_capacity():
    rules = Rules(
        {
            "swap": {"needs": {"a": 2}, "uses": {"a": 1}, "gives": {"a": 3, "b": 1}},  # asks for max(2, 1) of a
            "either": [{"uses": "b", "gives": "c"}, {"uses": "a", "gives": {"c": 2}}],  # uses b if there is one
        },
        target="c",
        capacity={"a": 3, "c": 2},
    )
    markings = np.array([[1, 0, 0], [2, 0, 0], [3, 1, 0], [0, 0, 2]])  # of a, b, c
    after, applies = rules.apply_all(markings)
    assert applies.tolist() == [[False, True], [True, True], [True, True], [False, False]]
    assert after[:, 0].tolist() == [[1, 0, 0], [3, 1, 0], [3, 1, 0], [0, 0, 2]]  # 2 - 1 + 3 is 4, and 3 fit
    assert after[:, 1].tolist() == [[0, 0, 2], [1, 0, 2], [3, 0, 1], [0, 0, 2]]
    assert rules.apply("swap", [1, 0, 0]) is None
    assert rules.apply("either", [3, 1, 0]).tolist() == [3, 0, 1]
    for goal, marking, message in (
        ("swop", [1, 0, 0], "the rules are swap, either; there is no 'swop'"),
        (["swap"], [1, 0, 0], "there is no a list"),
        ("swap", [1, 0], "a marking must be 3 whole numbers, one a fact, from 0 to its capacity, not a list"),
        ("swap", "abc", "a marking must be 3 whole numbers, one a fact, from 0 to its capacity, not 'abc'"),
        ("swap", [-1, 0, 0], "from 0 to its capacity"),
        ("swap", [99, 0, 0], "from 0 to its capacity"),
    ):
        with pytest.raises(InputError, match=message):
            rules.apply(goal, marking)
    for markings in ([1], [[1, 0, 0, 0]], 1):
        with pytest.raises(InputError, match="markings must have 3 counts, one a fact"):
            rules.apply_all(markings)
    with pytest.raises(InputError, match="rules must be given as a table, not 3"):
        Rules.from_dict(3)


def test_goal_that_gives_other_facts_is_a_target():
    ways = [{"gives": "gold"}, {"needs": "rope", "gives": {"gold": 2}}]
    rules = Rules({"open": ways, "climb": {"gives": "rope"}}, "open", {"gold": 2})
    assert rules.facts == ("gold", "open", "rope")
    assert rules == Rules.from_dict(rules.to_dict())
    assert rules.apply("open", [0, 0, 1]).tolist() == [1, 1, 1]
    assert hierroom.complexity.analyze(rules).fewest == 1


@pytest.mark.parametrize(
    "rules",
    [TUNNEL, Rules({"eine Tür": {"needs": {'"k"': 2}, "gives": "*"}}, "*", {'"k"': 2}, {'"k"': 1}, label="Grün")],
)
def test_rules_are_hashable_and_survive_files(rules, tmp_path):
    path = tmp_path / "mine.toml"
    assert rules.to_toml(path) == path.read_text("utf-8")
    again = Rules.from_toml(path)
    assert again == rules == Rules.from_dict(rules.to_dict()) == pickle.loads(pickle.dumps(rules))
    assert hash(again) == hash(rules)
    turned = Rules(dict(reversed(rules.rules.items())), rules.target, rules.capacity, rules.start)
    assert (turned == rules) == (turned.names == rules.names)  # goals and facts are numbered in their order
    assert again.name == (rules.label or "mine")
    assert hierroom.Rules is Rules
    with pytest.raises(ValueError, match="read-only"):
        rules.given[0] = 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((3, "x"), "rules must be a mapping from goals to what each needs, not 3"),
        (({}, "x"), "rules must have at least one goal; there is none"),
        (({1: {"gives": "x"}}, "x"), "the name of a rule must be a text of one line, not 1"),
        (({"a": 3}, "x"), "rule 'a' must be an alternative or a list of them, not 3"),
        (({"a": []}, "x"), "rule 'a' must be an alternative or a list of them, not a list"),
        (({"a": [3]}, "x"), "rule 'a' takes needs, uses, gives and nothing else, not 3"),
        (({"a": {"give": "x"}}, "x"), "rule 'a' takes needs, uses, gives and nothing else, not 'give'"),
        (({"a": {"gives": 3}}, "x"), "'gives' of rule 'a' must be a fact, a list of facts or a mapping .*, not 3"),
        (({"a": {"gives": {"x": 0}}}, "x"), "'gives' of rule 'a' for 'x' must be at least 1, not 0"),
        (({"a": {"gives": {"x": True}}}, "x"), "'gives' of rule 'a' for 'x' must be a whole number, not True"),
        (
            ({"a": {"gives": {"x": 10**5000}}}, "x"),
            "'gives' of rule 'a' for 'x' must be at most 1000000000, not a",
        ),
        (({"a": {"gives": ["x", ""]}}, "x"), "a fact in 'gives' of rule 'a' must be a text of one line, not ''"),
        ((A, "y"), r"the target must name facts of the rules \(x\), not 'y'"),
        ((A, ["x"]), r"the target must name facts of the rules \(x\), not a list"),
        ((A, "x", {"q": 1}), r"the capacity must name facts of the rules \(x\), not 'q'"),
        ((A, "x", {"x": 0}), "the capacity for 'x' must be at least 1, not 0"),
        ((A, "x", {}, {"q": 1}), r"the start must name facts of the rules \(x\), not 'q'"),
        ((A, "x", {"x": 2}, {"x": 3}), "the start has 3 of 'x', but its capacity is 2; raise the capacity"),
        ((A, "x", {}, {"x": 1}), "the target 'x' must not be there at the start"),
        ((A, "x", {}, {}, "\n"), "the name of rules must be a text of one line"),
    ],
)
def test_invalid_rules_raise_input_error(arguments, message):
    with pytest.raises(InputError, match=message) as caught:
        Rules(*arguments)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("target = ", "mine.toml is not a TOML file"),
        ("target = 'x'", "mine.toml: rules must hold tables of rules and a target, .* they hold target"),
        ("target = 'x'\n[rule.a]\ngives = 'x'", "they hold rule, target"),
        ("target = 'x'\n[rules.a]\ngive = 'x'", "mine.toml: rule 'a' takes needs, uses, gives and nothing else"),
    ],
)
def test_invalid_rules_file_raises_input_error(text, message, tmp_path):
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(InputError, match=message):
        Rules.from_toml(tmp_path / "mine.toml")


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
