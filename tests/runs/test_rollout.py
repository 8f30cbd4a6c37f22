"""Rollouts from Python: which episodes count, the contents of an episode, and the environments allowed."""

import json
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from turns_helpers import make

import hierroom
from hierroom.agents.player import make_player, quotas
from hierroom.agents.recorder import record
from hierroom.goals import COLOURS, EXIT_GOAL, FIRST_DOOR_GOAL
from hierroom.runs.assembly import make_agents
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trained_agent import TrainedAgent
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.support.files import to_json
from hierroom.turns.records import NO_OUTCOME, OTHER, REACHED, TIMED_OUT
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.constants import EXIT
from hierroom.worlds.escape_room.oracle import shortest_actions

SMALL = {"graph": "b", "size": 11, "max_steps": 100, "num_envs": 8, "minibatches": 2, "steps": 512}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run that learned twice: checkpoints before and after."""
    config = TrainConfig().changed(**SMALL)
    folder, trainer = RunFolder.create(tmp_path_factory.mktemp("rollouts") / "run", config), Trainer(config)
    folder.save_checkpoint(trainer.state_dict())
    while not trainer.is_done:
        trainer.advance()
    folder.save_checkpoint(trainer.state_dict())
    return folder.path


def is_same(levels, others):
    """Entry by entry: records have bytes between their entries that may hold anything."""
    return all((levels[name] == others[name]).all() for name in levels.dtype.names)


class EscapesOrWaits:
    """Escapes by the shortest way from the levels of even episodes, and turns on the spot in the others."""

    def step(self, turns):
        is_idle = turns.world.state.levels["episode"] % 2 == 1
        actions = np.ones(len(turns), int)
        for env in np.flatnonzero(~is_idle):
            actions[env] = shortest_actions(turns.world.get_state(env))[0]
        return turns.step(actions)


def test_rollout_does_not_favour_short_episodes():
    """Half of the episodes fail and take long: few are among the first to end, but half of those of a rollout."""
    env = EnvConfig("a", size=11, max_steps=400)
    turns, player, first_to_end = make("a", 16, size=11, max_steps=400, seed=5), EscapesOrWaits(), []
    while len(first_to_end) < 24:
        step = player.step(turns)
        first_to_end += step.terminated[step.episode_ended].tolist()
    assert np.mean(first_to_end[:24]) > 0.6
    played = list(hierroom.rollout(EscapesOrWaits(), env, 32, num_envs=16, seed=5))
    assert np.mean([episode.success for episode in played]) == 0.5
    assert [(episode.number, episode.env) for episode in played] == [(k, n) for k in (0, 1) for n in range(16)]
    assert {episode.seed for episode in played} == {5}


@given(st.integers(1, 12), st.integers(1, 7))
@settings(max_examples=15)
def test_record_gives_exact_episode_count_in_fixed_order(episodes, num_envs):
    played = list(record(make("a", num_envs, max_steps=20), make_player("random", 1), episodes))
    assert [(e.number, e.env) for e in played] == [divmod(k, num_envs) for k in range(episodes)]
    quota = quotas(episodes, num_envs)
    assert quota.sum() == episodes
    assert quota.max() - quota.min() <= 1


def test_first_episodes_do_not_depend_on_the_episode_count(run):
    agent = hierroom.load(run)
    few = list(hierroom.rollout(agent, None, 5, num_envs=4))
    many = hierroom.rollout(agent, None, 11, num_envs=4)
    for one, other in zip(few, many, strict=False):
        np.testing.assert_array_equal(one.actions, other.actions)
        assert is_same(one.start.levels, other.start.levels)
    other_seed = next(hierroom.rollout(agent, None, 5, num_envs=4, seed=2))
    assert not (other_seed.start.grids == few[0].start.grids).all()


@pytest.mark.parametrize("drop_key", [False, True])
def test_episode_records_every_step(drop_key):
    """Against the fields of each step, and the states of the world."""
    turns = make("d", 3, max_steps=90, subgoal_horizon=7, drop_key=drop_key, measure_shortest=True, reward="bonus")

    class Watched:
        """Plays random actions with the first legal goal as its subgoal, and notes everything."""

        def __init__(self):
            self.rng, self.steps, self.states = np.random.default_rng(4), [[] for _ in range(3)], [[], [], []]

        def step(self, turns):
            situation = turns.situation(turns.due("meta_0"))
            turns.choose(situation, np.array([m.argmax() for m in situation.masks], int))
            before = turns.world.get_state()
            step = turns.step(self.rng.integers(0, 7, size=3))  # 5 or 6 are illegal
            for env in range(3):
                self.states[env].append(before[env])
                names = ("actions", "goals", "events", "rewards", "extrinsic", "option_ended", "outcomes")
                self.steps[env].append([getattr(step, name)[env] for name in names])
            return step

    player = Watched()
    played = list(record(turns, player, 9))
    starts = [0, 0, 0]
    outcomes = set()
    for episode in played:
        env, length = episode.env, len(episode)
        part = slice(starts[env], starts[env] + length)
        starts[env] += length
        columns = list(zip(*player.steps[env][part], strict=True))
        for name, column in zip(("actions", "goals", "achieved", "rewards", "extrinsic"), columns, strict=False):
            np.testing.assert_array_equal(getattr(episode, name), column, err_msg=name)
        np.testing.assert_array_equal(episode.outcomes, np.where(columns[5], columns[6], NO_OUTCOME))
        replayed = list(episode.states())
        assert len(replayed) == length + 1
        for state, seen in zip(replayed, player.states[env][part], strict=False):
            np.testing.assert_array_equal(state.grids, seen.grids)
            assert is_same(state.levels, seen.levels)
        assert replayed[-1].levels[0].steps == length
        assert episode.success == (episode.terminated and not episode.truncated)
        assert episode.terminated != episode.truncated
        assert sum(subgoal.steps for subgoal in episode.subgoals) == length
        assert all(f" {s.name}".endswith(f" {s.label}") for s in episode.subgoals)
        assert [s.first_step for s in episode.subgoals[1:]] == [s.first_step + s.steps for s in episode.subgoals[:-1]]
        assert 0 < episode.shortest <= 90
        outcomes |= set(episode.outcomes.tolist())
    assert outcomes == {NO_OUTCOME, REACHED, TIMED_OUT, OTHER}


def test_goals_are_named_by_colour_and_room():
    (episode,) = hierroom.rollout("oracle", EnvConfig("c", size=11), 1, seed=3)
    colours = episode.start.levels[0].colours
    doors = [f"{COLOURS[colours[room - 1]]} door {room}" for room in (1, 2)]
    keys = [f"{COLOURS[colours[room - 1]]} key {room}" for room in (1, 2)]
    assert [event.name for event in episode.events] == [keys[0], doors[0], keys[1], doors[1], "exit"]
    assert [event.goal for event in episode.events][1::2] == [FIRST_DOOR_GOAL + colour for colour in colours[:2]]
    assert episode.events[-1].goal == EXIT_GOAL
    assert episode.events[-1].step == len(episode) == episode.shortest
    absent = next(colour for colour in range(6) if colour not in colours[:2])
    assert episode.name_of(absent) == f"{COLOURS[absent]} key"
    assert episode.name_of(-1) == "no goal"
    *_, last = episode.states()
    assert last.grids[0, last.levels[0].row, last.levels[0].col] == EXIT


def test_episode_to_dict_has_labels():
    (episode,) = hierroom.rollout("random", EnvConfig("a", size=11, max_steps=30, reward="bonus"), 1)
    table = json.loads(to_json(episode.to_dict()))
    assert table["length"] == len(table["actions"]) == len(table["rewards"]) == len(episode)
    assert set(table["actions"]) <= {"forward", "left", "right", "pick up", "open"}
    assert table["return"] == sum(table["rewards"])
    assert table["success"] is episode.success
    assert set(table["subgoals"][0]) == {"goal", "name", "label", "first_step", "steps", "outcome"}
    assert "graph a, seed 0, environment 0, episode 0" in repr(episode)


def test_rollout_is_the_same_in_every_api(run):
    agent = hierroom.load(run)
    config = EnvConfig("a", size=13, max_steps=15, reward="bonus", goal_mask="existing")
    arguments = {"graph": "a", "size": 13, "max_steps": 15, "reward": "bonus", "goal_mask": "existing"}
    expected = [episode.to_dict() for episode in hierroom.rollout(agent, config, 4)]
    assert expected[0]["graph"] == "a"
    envs = [hierroom.env(**arguments), hierroom.parallel_env(**arguments)]
    envs += [gymnasium.make("hierroom/EscapeRoom-v0", **arguments)]
    envs += [gymnasium.make_vec("hierroom/EscapeRoom-v0", num_envs=3, **arguments)]
    envs += [hierroom.add_features(hierroom.parallel_env(**arguments), ["goal-place"])]
    envs += [hierroom.minigrid_view(envs[2]), hierroom.sb3_view(envs[3])]
    for env in envs:
        assert [episode.to_dict() for episode in hierroom.rollout(agent, env, 4)] == expected
    assert {len(e.start.grids[0]) - 10 for e in hierroom.rollout(agent, None, 2)} == {11}  # where it was trained


def test_invalid_rollout_arguments_raise_input_error(run):
    agent, in_shop = hierroom.load(run), TrainConfig().changed(task="workshop:4", num_envs=4, meta="learned")
    of_shop = TrainedAgent(in_shop, *make_agents(in_shop), 0)
    for arguments, message in (
        ((agent, EnvConfig(drop_key=True)), "a trained agent cannot be played with another drop_key"),
        ((agent, EnvConfig(task="workshop:4")), "in environments with other actions than task workshop:4 has"),
        ((of_shop, EnvConfig("a")), "in environments with other actions than graph a has"),
        ((of_shop, EnvConfig(task="workshop:6")), "in environments with other actions than task workshop:6 has"),
        ((agent, gymnasium.make("CartPole-v1")), "env must be an EnvConfig or an environment of hierroom, not"),
        ((agent, None, 0), "episodes must be at least 1, not 0"),
        (("nobody",), "the players without training are random and oracle; there is no 'nobody'"),
        ((7,), "an agent to play is what hierroom.load gives, 'random', 'oracle' or .*, not 7"),
    ):
        with pytest.raises(InputError, match=message):
            hierroom.rollout(*arguments)
    calls: tuple[tuple[Any, dict[str, Any], str], ...] = (
        (agent.pair, {"num_envs": 0}, "num_envs must be at least 1, not 0"),
        (agent.meta_controller, {"num_envs": 1.5}, "num_envs must be a whole number, not 1.5"),
        (agent.pair, {"num_envs": 1, "seed": -1}, "seed must be at least 0, not -1"),
        (of_shop.meta_controller, {"seed": None}, "seed must be a whole number, not None"),
    )
    for call, named, message in calls:
        with pytest.raises(InputError, match=message):
            call(**named)
    idle = SimpleNamespace(step=lambda turns: None)
    with pytest.raises(InputError, match=r"^step of a player must return the Step that turns\.step returned, not"):
        list(hierroom.rollout(idle, EnvConfig("a")))
    for player in (agent, "random", "oracle"):
        with pytest.raises(InputError, match="seed must be at least 0, not -1"):
            hierroom.rollout(player, seed=-1)


def test_agent_turns_use_the_trained_reward_by_default(run):
    agent = hierroom.load(run)
    paid = replace(agent, config=agent.config.changed(reward="bonus"))
    for env in (None, agent.env(graph="c"), EnvConfig("c")):
        assert paid.turns(2, env=env).reward.name == "the reward 'bonus'"
    assert paid.turns(2, env=EnvConfig("c", reward="novelty")).reward.name == "the reward 'novelty'"
