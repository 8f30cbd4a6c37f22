"""The replays of a report: every state of an episode, and the numbers that its agents computed."""

import json

import numpy as np
import pytest

import hierroom
from hierroom.agents.recorder import record
from hierroom.lab.report.replay import LETTERS, DecisionTape, replay
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.session import begin
from hierroom.turns.records import CONTROLLER, META
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.constants import MARGIN
from hierroom.worlds.escape_room.render import view_of


def tiles_of(letters):
    return np.array([LETTERS.index(letter) for letter in letters])


def assert_same(recorded, episode):
    tiles = tiles_of(recorded["tiles"])
    for step, state in enumerate(episode.states()):
        if step:
            for cell, tile in recorded["changes"][step - 1]:
                tiles[cell] = tile
        np.testing.assert_array_equal(tiles, state.grids[0, MARGIN:-MARGIN, MARGIN:-MARGIN].ravel())
        np.testing.assert_array_equal(tiles_of(recorded["views"][step]), view_of(state).ravel())
        level = state.levels[0]
        assert (recorded["rows"][step], recorded["cols"][step]) == (level.row - MARGIN, level.col - MARGIN)
        assert recorded["directions"][step] == level.direction
        assert (recorded["keys"][step], recorded["doors"][step]) == (level.keys, level.doors)
        if recorded["rooms"][step] >= 0:
            top, left, bottom, right = level.rectangles[recorded["rooms"][step]]
            assert top <= level.row <= bottom
            assert left <= level.col <= right
        else:
            assert (level.row, level.col) in set(map(tuple, level.doors_at.tolist()))
    assert len(recorded["views"]) == len(episode) + 1
    assert recorded["goals"] == episode.goals.tolist()


@pytest.mark.parametrize("entries", [{"graph": "f"}, {"graph": "c", "drop_key": True}, {"graph": "b", "size": 11}])
def test_a_replay_has_every_state(entries):
    for player in ("oracle", "random"):
        episode = next(hierroom.rollout(player, EnvConfig(**{"max_steps": 300, **entries}), 1))
        recorded = json.loads(json.dumps(replay(episode)))
        assert_same(recorded, episode)
        assert recorded["controller"] is None
        assert recorded["success"] is episode.success
        assert {recorded["names"][str(goal)] for goal in recorded["achieved"] if goal >= 0} == {
            e.name for e in episode.events
        }


@pytest.mark.parametrize("greedy", [False, True])
def test_replay_has_the_decisions_of_both_agents(tmp_path, greedy):
    entries = {"meta": "learned", "meta_start_success": 0.0, "num_envs": 8, "minibatches": 2, "steps": 512}
    begin(TrainConfig(EnvConfig("a", size=11, max_steps=60)).changed(**entries), tmp_path / "run")
    agent = hierroom.load(tmp_path / "run", greedy=greedy)
    tape = DecisionTape(agent.pair(4, seed=5))
    for env, episode in enumerate(record(agent.turns(4, seed=5), tape, 4)):
        decisions = tape.of_first_episode(CONTROLLER, env, len(episode))
        assert list(decisions["steps"]) == list(range(len(episode)))
        probabilities = np.array(decisions["probabilities"])
        np.testing.assert_allclose(probabilities.sum(axis=1), 1, rtol=5e-3)
        taken = probabilities[np.arange(len(episode)), episode.actions]
        assert (taken > 0).all()
        if greedy:
            np.testing.assert_array_equal(taken, probabilities.max(axis=1))
        recorded = tape.of_first_episode(META, env, len(episode))
        starts = [subgoal.first_step - 1 for subgoal in episode.subgoals]
        assert list(recorded["steps"]) == starts
        chosen = np.array(recorded["probabilities"])
        assert chosen.shape == (len(starts), 14)
        goals = [subgoal.goal for subgoal in episode.subgoals]
        assert (chosen[np.arange(len(goals)), goals] > 0).all()  # 13, the last, is no goal, as is -1
        assert_same(replay(episode, decisions, recorded), episode)
