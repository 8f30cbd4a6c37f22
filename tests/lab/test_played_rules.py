"""Rules estimated from play, against those that were declared."""

import numpy as np
import pytest

from hierroom.goals import GoalGraph
from hierroom.goals.rules import Rules
from hierroom.lab.advise.played_rules import PlayedRules
from hierroom.support.errors import InputError


def played(rules, n_episodes, seed=0, most=60):
    """Yield the goals of episodes that take applicable rules at random until the target is reached."""
    rng, target = np.random.default_rng(seed), rules.facts.index(rules.target)
    for _ in range(n_episodes):
        marking, achieved = rules.start_marking, []
        while not marking[target] and len(achieved) < most:
            after, applies = rules.apply_all(marking)
            changes = np.flatnonzero(applies & (after != marking).any(axis=1))
            rule = int(rng.choice(changes))
            marking = after[rule]
            achieved.append(rules.names[rule])
        yield achieved


def plain(rules):
    """The goals that each rule needs or uses, as sets of (goal, count)."""
    return {
        name: {
            frozenset((fact, n) for fact, n in {**way.uses, **way.needs}.items() if fact in rules.rules) for way in ways
        }
        for name, ways in rules.rules.items()
    }


@pytest.mark.parametrize("letter", "abcdefg")
def test_rules_of_goal_graphs_are_found_from_random_walks(letter):
    declared = GoalGraph.named(letter).rules()
    found = PlayedRules.of(played(declared, 200), declared.names, "exit")
    assert plain(found.rules) == plain(declared)


def test_goals_achieved_once_are_needed_once():
    episodes = [["edge", "edge", "gift"]]
    assert PlayedRules.of(episodes, ["edge", "gift"], "gift").ways["gift"] == ({"edge": 2},)
    assert PlayedRules.of(episodes, ["edge", "gift"], "gift", once=["edge"]).ways["gift"] == ({"edge": 1},)


def test_play_rules_find_alternatives_and_counts():
    declared = Rules(
        {
            "wood": {"gives": "wood"},
            "rope": {"gives": "rope"},
            "raft": [{"needs": {"wood": 3}, "gives": "raft"}, {"needs": ["wood", "rope"], "gives": "raft"}],
            "flower": {"gives": "flower"},
        },
        target="raft",
        capacity={"wood": 3},
    )
    found = PlayedRules.of(played(declared, 400), declared.names, "raft")
    assert plain(found.rules) == plain(declared)
    assert found.rules.capacity["wood"] == 3


def test_coincidental_need_disappears_with_a_counterexample():
    first = PlayedRules.of([["coin", "key", "door"]], ("coin", "key", "door"), "door")
    assert first.ways["door"] == ({"key": 1},)  # of which the coin was there before, too
    assert first.ways["key"] == ({"coin": 1},)
    second = PlayedRules.of([["coin", "key", "door"], ["key", "door"]], ("coin", "key", "door"), "door")
    assert second.ways["key"] == ({},)


def test_never_achieved_target_raises_input_error():
    found = PlayedRules.of([["key"]], ("key", "door"), "door")
    with pytest.raises(InputError, match="the target 'door' was never achieved in 1 episodes of play"):
        found.rules  # noqa: B018
