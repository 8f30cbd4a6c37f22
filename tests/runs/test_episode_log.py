"""The log of episodes, counted by hand: window, milestones, rows, options, and going back to a saved state."""

import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from escape_room import WORLD
from same_state import equal
from turns_helpers import make

from hierroom.agents.player import OraclePlayer
from hierroom.meta import make_meta, take_turn
from hierroom.runs.logs.episode_log import MOST_NAMED, WINDOW, EpisodeLog


def ended(*successes: bool, length: int = 10) -> Any:
    """A step that ended one episode in each of these environments, and none in one more."""
    flags = np.array([*successes, False])
    n = len(flags)
    ends, columns = np.arange(n) < n - 1, {"lengths": length, "rewards": 0.5, "shortest": -1, "goals": -1}
    return SimpleNamespace(
        **dict.fromkeys(("episode_ended", "option_ended"), ends),
        **dict.fromkeys(("terminated", "reached", "success"), flags),
        **{name: np.full(n, value) for name, value in columns.items()},
        achieved_bits=np.where(flags, 1 << 12, 0),
        achieved=flags[:, None] & (np.arange(13) == 12),
    )


def places(n: int) -> Any:
    """Turns with only a world, which reports the episodes that ended."""
    world = SimpleNamespace(
        everywhere=np.arange(n), variants_of=lambda envs: ["c"] * len(envs), milestones_of=lambda envs, goals: goals
    )
    return SimpleNamespace(world=world, n_ended=n)


def test_means_cover_the_last_episodes_in_the_window():
    log, turns = EpisodeLog(WORLD.goals, np.zeros(2, int)), places(2)
    for n in range(WINDOW - 1):
        log.add(ended(True), turns, n)
    assert log.means["success_rate"] == 1
    log.add(ended(False), turns, 1000)
    assert log.episodes == WINDOW
    assert log.means["success_rate"] == (WINDOW - 1) / WINDOW
    for n in range(300):
        log.add(ended(False, length=30), turns, 2000 + n)
    assert log.means["success_rate"] == 199 / WINDOW
    assert log.means["episode_length"] == (200 * 10 + 300 * 30) / WINDOW
    assert log.means["episode_return"] == 0.5


def test_step_adds_rewards_and_load_state_dict_restores_log():
    log, other, turns = EpisodeLog(WORLD.goals, np.zeros(4, int)), EpisodeLog(WORLD.goals, np.zeros(4, int)), places(4)
    log.add(ended(True, False, True), turns, 5)
    before = log.state_dict()
    assert before["returns"].tolist() == [0, 0, 0, 0.5]
    quiet = ended(False, False, False)
    quiet.episode_ended[:] = False
    log.add(quiet, turns, 6)
    assert log.state_dict()["returns"].tolist() == [0.5, 0.5, 0.5, 1.0]
    assert {name: log.state_dict()[name] for name in ("episodes", "window")} == {
        name: before[name] for name in ("episodes", "window")
    }
    assert log.means["success_rate"] == 2 / 3
    other.load_state_dict(before)
    assert equal(other.state_dict(), before)
    other.add(ended(True, True, True), turns, 7)
    assert before["returns"].tolist() == [0, 0, 0, 0.5], "the state is a copy"


def test_row_lists_the_achieved_goals_in_order():
    """Against a count by hand of the oracle's episodes on graph f, in environments that end at different steps."""
    turns, log = make("f", n=5, size=13, max_steps=60, reward="bonus"), EpisodeLog(WORLD.goals, np.zeros(5, int))
    player = OraclePlayer()
    achieved: list[list[str]] = [[] for _ in range(5)]
    returns, expected = np.zeros(5), []
    for t in range(1, 90):
        branches = turns.world.state.levels["branches"].copy()
        step = player.step(turns)
        returns += step.rewards
        for env, event in enumerate(step.events.tolist()):
            if event >= 0:
                room = 1 + int(branches[env][event % 6]) if event < 12 else 0
                achieved[env].append("exit" if event == 12 else f"{'key' if event < 6 else 'door'} {room}")
        log.add(step, turns, 5 * t)
        for env in np.flatnonzero(step.episode_ended).tolist():
            numbers = {"success": int(step.terminated[env]), "length": int(step.lengths[env]), "return": returns[env]}
            expected.append({"steps": 5 * t, "env": env, "graph": "f", **numbers, "goals": json.dumps(achieved[env])})
            achieved[env], returns[env] = [], 0.0
    assert log.ended == expected
    assert len(expected) > 4
    assert any(row["success"] and row["goals"].endswith('"door 3", "exit"]') for row in expected)
    log.begin_update()
    assert log.ended == []


def test_row_names_each_milestone_and_counts_the_others():
    log, turns, step = EpisodeLog(WORLD.goals, np.zeros(2, int)), places(2), ended(True)
    log.add(step, turns, 1)
    goals = [*[12] * MOST_NAMED, 6, 12, 12]
    for n, goal in enumerate(goals):
        step.achieved[0], step.episode_ended[0] = np.arange(13) == goal, n == len(goals) - 1
        log.add(step, turns, n)
    exits = ["exit"] * MOST_NAMED
    assert [json.loads(str(row["goals"])) for row in log.ended] == [["exit"], [*exits, "door 1", 2]]


def test_options_are_counted_by_the_kind_of_their_goal():
    turns, log = make("c", n=6, subgoal_horizon=20), EpisodeLog(WORLD.goals, np.zeros(6, int))
    meta = make_meta("fixed-dfs")
    kinds = {"key": range(6), "door": range(6, 12), "exit": [12], "new": [-1]}
    given, reached = dict.fromkeys(kinds, 0), dict.fromkeys(kinds, 0)
    rng = np.random.default_rng(0)
    for t in range(600):
        if t % 3:  # elsewhere there is no goal
            take_turn(meta, turns)
        step = turns.step(rng.integers(5, size=6))
        log.add(step, turns, 6 * t)
        for name, goals in kinds.items():
            chosen = step.option_ended & np.isin(step.goals, goals)
            given[name] += int(chosen.sum())
            reached[name] += int((chosen & step.reached).sum())
    assert given["key"] > 20
    assert given["new"] > 5
    for name in kinds:
        share = reached[name] / given[name] if given[name] else float("nan")
        assert log.reached[f"reached_{name}"] == pytest.approx(share, nan_ok=True)
    log.begin_update()
    assert all(np.isnan(value) for value in log.reached.values())


def test_staggered_clocks_do_not_change_row_lengths():
    turns, player = make("a", n=8, size=11, max_steps=40), OraclePlayer()
    turns.world.stagger_clocks()
    log = EpisodeLog(WORLD.goals, turns.world.clocks())
    begun, played = np.zeros(8, int), []
    for t in range(1, 121):
        step = player.step(turns) if t > 60 else turns.step(np.zeros(8, int))
        log.add(step, turns, 8 * t)
        if t == 3:
            log.load_state_dict(log.state_dict())
        for env in np.flatnonzero(step.episode_ended).tolist():
            played.append(t - int(begun[env]))
            begun[env] = t
    assert [row["length"] for row in log.ended] == played
    assert {5, 40} < set(played), "the shortest first episode, and whole ones"
