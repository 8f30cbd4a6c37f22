"""Workshops, compared step by step with the same rules in plain Python."""

import numpy as np
import pytest
from workshop_twin import CRAFT, MELT, Twin, random_rules

import hierroom
from hierroom import EnvConfig, Rules
from hierroom.support.errors import InputError
from hierroom.worlds.workshop.tech_tree import tech_tree

FIELDS = ("achieved", "n_first", "is_novel", "is_discovery", "reward", "terminated", "truncated", "length")
TREES = {"craft": CRAFT, "melt": MELT, "tree": tech_tree(5), "wide": tech_tree(6, 3, "wide")}


def make(rules, n=1, seed=0, **entries):
    task = hierroom.workshop(rules)
    return task.make_world(EnvConfig(task=task, **entries), n, seed=seed)


def act(world, *things):
    """Put things on the bench of the only workshop and work; then return the goals achieved, by name."""
    places, n_places = world.state.things[0, 0], world.n_actions - 2
    for thing in things:
        place = places[:n_places].tolist().index(world.book.things.index(thing))
        world.step(np.array([place]))
    achieved = int(world.step(np.array([n_places]))["achieved"][0])
    return [name for goal, name in enumerate(world.goals.names) if achieved >> goal & 1]


@pytest.mark.parametrize("levels", [None, "training", "evaluation"])
@pytest.mark.parametrize("rules", TREES.values(), ids=TREES)
def test_workshops_equal_plain_python_step_by_step(rules, levels):
    assert compare_with_twins(rules, levels, n_steps=400) > 40


@pytest.mark.slow
def test_workshops_of_random_rules_equal_plain_python():
    rng = np.random.default_rng(3)
    assert sum(compare_with_twins(random_rules(rng), None, n_steps=60) for _ in range(30)) > 1000


def compare_with_twins(rules, levels, n_steps):
    """Compare workshops with their twins; return the number of steps that achieved a goal."""
    world = make(rules, 4, seed=7, max_steps=60, env_index=2, levels=levels)
    twins = [Twin(rules, 7, 2 + n, levels, 60) for n in range(4)]
    rng, turns, n_goals = np.random.default_rng(1), np.ones(4, bool), 0
    for _ in range(n_steps):
        world.set_arrays(world.get_arrays(world.everywhere))
        shown = world.observe(world.everywhere).as_dict()["observation"].tolist()
        assert shown == [twin.observation() for twin in twins]
        legal = world.legal_goals("reachable", turns)[:, :-1]
        names = [{name for name, is_legal in zip(rules.names, row, strict=True) if is_legal} for row in legal]
        assert names == [twin.reachable() for twin in twins]
        actions = rng.integers(-1, world.n_actions + 1, 4)
        for n, twin in enumerate(twins):  # otherwise few goals that take three things are achieved
            if rng.random() < 0.5:
                actions[n] = right_action(rng, twin)
        expected = [twin.step(action) for twin, action in zip(twins, actions.tolist(), strict=True)]
        assert [tuple(row[name] for name in FIELDS) for row in world.step(actions)] == expected
        n_goals += sum(bool(row[0]) for row in expected)
    return n_goals


def right_action(rng, twin):
    """Return an action towards some possible goal: put the next thing, work, or clear."""
    for _, ask, way in twin.ways:
        if twin.makes(ask, way) and all(twin.bench[thing] <= ask.get(thing, 0) for thing in twin.bench):
            missing = [place for place, thing in enumerate(twin.places) if twin.bench[thing] < ask.get(thing, 0)]
            return rng.choice(missing) if missing else len(twin.places)
    return len(twin.places) + 1


def test_needed_things_return_and_used_things_vanish():
    world = make(CRAFT)
    assert act(world, "wood") == ["stick"]
    assert act(world, "stick", "stick") == ["pick"]
    assert act(world, "pick", "source of gem") == ["gem"]
    assert act(world, "pick", "source of stone") == ["stone"]
    left = dict(zip(world.book.things, world.state.things[0, 1].tolist(), strict=True))
    assert {thing: n for thing, n in left.items() if n and "source" not in thing} == {
        "dust": 1, "pick": 1, "gem": 1, "stone": 1,
    }  # fmt: skip


def test_wrong_bench_makes_nothing_and_stays():
    world = make(CRAFT)
    assert act(world, "wood", "source of log") == []
    assert world.state.things[0, 2].sum() == 2
    world.step(np.array([world.n_actions - 1]))
    assert world.state.things[0, 2].sum() == 0
    assert act(world, "source of log") == ["log"]


def test_any_rule_for_the_target_achieves_the_target_goal():
    world = make(CRAFT)
    for things in (("wood",), ("stick", "stick"), *(("pick", "source of gem"),) * 2):
        act(world, *things)
    assert act(world, "gem", "gem") == ["crown", "ring"]
    assert world.outcomes["terminated"][0]
    assert world.outcomes["n_first"][0] == 2


def test_invalid_workshop_rules_raise_input_error():
    for rules, said in (
        (Rules({"a": {"uses": "b", "gives": "c"}}, target="c"), "no order of the rules makes the target 'c'"),
        (Rules({"a": {"gives": "b"}, "c": {"uses": {"b": 2}, "gives": "d"}}, target="d"), "no order of the rules"),
        (Rules({"a": {"gives": "b"}}, target="b", capacity={"b": 255}), "at most 254 of a thing; the capacity of 'b'"),
        (Rules({f"rule {n}": {"gives": "b"} for n in range(64)}, target="b"), "at most 63 rules"),
        ({"a": {"gives": "b"}}, "is made of hierroom.Rules, not of"),
    ):
        with pytest.raises(InputError, match=said):
            hierroom.workshop(rules)
