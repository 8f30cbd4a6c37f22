"""Rules estimated from play, against those that were declared."""

import json
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import hierroom
from hierroom.agents.player import make_player
from hierroom.commands.complexity import main as complexity
from hierroom.complexity import analyze
from hierroom.complexity.play_rules import PlayedRules
from hierroom.goals import GoalGraph
from hierroom.goals.rules import Rules
from hierroom.lab.measure import graph_of, play_rules
from hierroom.support.errors import InputError
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.make import find_task


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


def test_play_rules_count_only_counted_goals():
    class Walk(gymnasium.Env):
        observation_space, action_space = gymnasium.spaces.Discrete(9), gymnasium.spaces.Discrete(2)

        def reset(self, *, seed=None, options=None):
            self.steps = 0
            return 0, {}

        def step(self, action):
            self.steps += 1
            return self.steps % 9, 0.0, self.steps == 8, False, {}

    odd, counted = (lambda env, info: env.unwrapped.steps % 2 == 1), (lambda env, info: env.unwrapped.steps // 2)
    goals = {"odd": odd, "pair": counted, "end": lambda env, info: env.unwrapped.steps == 8}
    task = hierroom.Task(Walk, goals, target="end")
    found = play_rules(Turns(EnvConfig(task=task), 2, seed=0), make_player("random", 0), 4)
    assert found.ways["end"] == ({"pair": 4},)  # which asks for odd itself, once


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


def all_needs(needs, goal):
    """Return all goals that must be achieved before a goal, directly or through others."""
    direct = {name for way in needs[goal] for name, _ in way}
    return direct.union(*(all_needs(needs, name) for name in direct))


@pytest.mark.parametrize(("spec", "episodes"), [("workshop:4", 100), ("workshop:6", 300)])
def test_needs_of_workshops_are_found_from_random_actions(spec, episodes):
    declared = find_task(spec).rules
    found = play_rules(Turns(EnvConfig(task=spec), 50, seed=1), make_player("random", 1), episodes).rules
    ours, theirs = plain(found), plain(declared)
    for goal in declared.names:
        assert all_needs(ours, goal) == all_needs(theirs, goal)
    # As nothing is used up in rules from play, they ask for all that was made of a thing until then.
    assert analyze(found).fewest == analyze(declared).fewest


def test_coincidental_need_disappears_with_a_counterexample():
    first = PlayedRules.of([["coin", "key", "door"]], ("coin", "key", "door"), "door")
    assert first.ways["door"] == ({"key": 1},)  # of which the coin was there before, too
    assert first.ways["key"] == ({"coin": 1},)
    second = PlayedRules.of([["coin", "key", "door"], ["key", "door"]], ("coin", "key", "door"), "door")
    assert second.ways["key"] == ({},)
    assert str(second).splitlines()[1:] == [
        "  goal  seen  before it, always (an upper bound of what is needed)",
        "  coin     1  nothing",
        "  key      2  nothing",
        "  door     2  key",
    ]


def test_never_achieved_target_raises_input_error():
    found = PlayedRules.of([["key"]], ("key", "door"), "door")
    assert found.seen["door"] == 0
    with pytest.raises(InputError, match="the target 'door' was never achieved in 1 episodes of play"):
        found.rules  # noqa: B018


def test_command_keeps_the_counts_and_rules_of_what_was_achieved(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    found = PlayedRules.of([["key", "coin"], ["key"], []], ("key", "coin", "door"), "door")
    monkeypatch.setattr("hierroom.lab.measure.played_by", lambda *_: found)
    words = ["--task", "chest_task:free", "--from-play", "random"]
    assert complexity([*words, "--out", "found.toml"]) == 0
    said = capsys.readouterr()
    assert "  door     0  never achieved" in said.out
    assert "from play: 2 rules, target coin" in said.out
    assert "'door' was never achieved in 3 episodes of play" in said.err
    assert Rules.from_toml("found.toml") == found.rules_to("coin")
    assert complexity([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["seen"] == {"key": 2, "coin": 1, "door": 0}
    found = PlayedRules.of([[]], ("door",), "door")
    for option, shown in (((), "never achieved"), (("--json",), '"door": 0')):
        with pytest.raises(InputError, match="'door' was never achieved in 1 episodes of play"):
            complexity([*words, *option])
        assert shown in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("letter", "abcdefg")
def test_rules_of_levels_are_found_from_a_trained_agent(letter):
    agent = hierroom.load(letter, meta="random")
    found = play_rules(agent.turns(100, seed=1), agent.pair(100, seed=1), 300)
    assert plain(found.rules) == plain(GoalGraph.named(letter).rules())


def test_played_rules_are_written_even_if_they_cannot_be_analyzed(tmp_path, monkeypatch):
    leaves = [f"leaf {n}" for n in range(17)]
    ways = {**{leaf: ({},) for leaf in leaves}, "root": (dict.fromkeys(leaves, 1),)}
    found = PlayedRules(5, dict.fromkeys(ways, 5), ways, "root")
    monkeypatch.setattr("hierroom.lab.measure.played_by", lambda *_: found)
    files = ["--out", str(tmp_path / "found.toml"), "--draw", str(tmp_path / "found.png")]
    with pytest.raises(InputError, match="at most 100,000"):
        complexity(["--task", "chest_task:free", "--from-play", "random", *files])
    assert Rules.from_toml(tmp_path / "found.toml") == found.rules


def test_command_prints_and_writes_played_rules(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert (
        complexity(["--task", "chest_task:free", "--from-play", "random", "--episodes", "200", "--out", "found.toml"])
        == 0
    )
    shown = capsys.readouterr().out
    assert "chest" in shown
    assert "from play: 3 rules, target chest" in shown
    assert plain(Rules.from_toml("found.toml"))["chest"] == {frozenset({("key", 1)})}
    few = ["--task", "chest_task:free", "--from-play", "random", "--episodes", "20"]
    assert complexity([*few, "--json", "--draw", "found.png"]) == 0
    assert json.loads(capsys.readouterr().out)["episodes"] == 20
    assert Path("found.png").stat().st_size > 0
    with pytest.raises(InputError, match="the chain of a task is not measured from play"):
        graph_of(Turns(EnvConfig(task="chest_task:free"), 1))
