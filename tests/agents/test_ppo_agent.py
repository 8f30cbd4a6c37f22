"""The agent that learns, as meta-controller: turns by hand, masks, warm-up, resuming, playing, and its network."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from escape_room import WORLD
from same_state import equal
from turns_helpers import goal_ids, make

from hierroom.agents.features import Features
from hierroom.agents.goal_network import GoalNetwork
from hierroom.agents.ppo_agent import FrozenAgent, PPOAgent
from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS, N_GOALS
from hierroom.learners.config import PPOConfig
from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.runs.assembly import make_agents, make_turns
from hierroom.runs.config.presets import find_preset
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trained_agent import load
from hierroom.runs.trainer import Trainer
from hierroom.turns.records import CONTROLLER, META, OTHER, REACHED, TIMED_OUT, Step
from hierroom.worlds.escape_room.oracle import shortest_actions

META_PPO = PPOConfig(sequence_length=4, sequences_per_update=4, minibatches=2, epochs=2, hidden_size=8)
PRESET = find_preset("learned")
SMALL = PRESET.changed(graph="a", size=11, max_steps=60, subgoal_horizon=10, num_envs=8, steps=4096, threads=1)
SMALL = SMALL.changed(ppo=PPOConfig(sequence_length=16, minibatches=2, epochs=2, hidden_size=8))
SMALL = SMALL.changed(meta_ppo=META_PPO, meta_start_success=0.0)
FLAGS = ["--meta", "learned", "--graph", "a", "--size", "11", "--max-steps", "60", "--num-envs", "8"]
FLAGS += ["--sequence-length", "16", "--minibatches", "2", "--epochs", "2", "--threads", "1"]


def learned_state(trainer):
    state = trainer.state_dict()
    return {name: state[name] for name in ("agents", "turns", "steps")}


def learned_meta(config=SMALL):
    agent, _ = make_agents(config)
    assert isinstance(agent, PPOAgent)
    return agent


def take_turns(agent, turns, goals=None):
    """Let the meta-controller take its turns where they are due; with a list of goals it chooses the first of these."""
    due = turns.due(META)
    if len(due):
        observation = turns.observe(META, due)
        if agent.ready:
            agent.update(observation, 0.0)
        chosen = agent.act(observation)
        turns.act(META, observation, chosen if goals is None else [goals.pop(0)])


def move(turns, action=1):
    observation = turns.observe(CONTROLLER, turns.due(CONTROLLER))
    turns.act(CONTROLLER, observation, np.full(len(turns), action))
    return turns.step()


def shortest_way(turns, name):
    return shortest_actions(turns.world.get_state(), *goal_ids(turns, name))


def play(graph, goals, script, **settings):
    """Play in one environment: choose these goals while the controller goes to those of a script, or turns left (-1).

    Returns the values given to `Learner.finish` for each decision, its last features, and the last observed features.
    """
    turns = make(graph, goal_mask="existing", **settings)
    ppo, meta_ppo = replace(SMALL.ppo, minibatches=1), replace(META_PPO, sequence_length=50)
    agent = learned_meta(SMALL.changed(num_envs=1, ppo=ppo, meta_ppo=meta_ppo))
    goals = [next(iter(goal_ids(turns, goal))) for goal in goals]
    recorded, valued, observed_last = [], [], []
    finish = agent.learner.finish

    def note_finish(envs, *values):
        if len(envs):
            recorded.append(tuple(value[0].item() for value in values[:5]))
            valued.append(values[5])
        finish(envs, *values)

    agent.learner.finish = note_finish
    for name in script:
        for action in [1] if name == -1 else shortest_way(turns, name):
            take_turns(agent, turns, goals)
            step = move(turns, action)
            ended, *_ = step.ended_turns(META)
            observed_last.extend(agent.features.encode(turns.final_observation(META, step, ended)))
            agent.record(step, turns)
    return recorded, valued, observed_last


def test_each_decision_has_its_options_reward_and_length():
    turns = make("a")
    key = len(shortest_way(turns, "k1"))
    total = len(shortest_actions(turns.world.get_state()))
    recorded, valued, observed_last = play("a", ["k1", "d1", "x"], ["k1", "d1", "x"])
    door = recorded[1][1]
    assert recorded == [
        (0, key, False, False, False),
        (0, door, False, False, False),
        (1, total - key - door, True, False, True),
    ]
    assert valued == [None] * 3
    for features, name in zip(observed_last, ["k1", "d1", "x"], strict=True):
        outcomes = features[N_GOALS:]
        assert outcomes[[*goal_ids(turns, name)]] == REACHED
        assert np.count_nonzero(outcomes) == 1


def test_horizon_and_time_limit_do_not_terminate():
    recorded, valued, observed_last = play("a", ["x", "x"], [-1] * 5, subgoal_horizon=3, max_steps=5)
    assert recorded == [(0, 3, False, False, False), (0, 2, False, True, True)]
    outcomes = [features[N_GOALS + EXIT_GOAL] for features in observed_last]
    assert outcomes == [TIMED_OUT, OTHER]  # the last from before the reset
    assert valued[0] is None
    np.testing.assert_array_equal(valued[1], observed_last[1:])


@pytest.mark.parametrize("mask", ["existing", "seen", "none", "reachable"])
@pytest.mark.parametrize("start_success", [0.0, 1.0], ids=["learning", "at random"])
def test_no_masked_goal_is_ever_chosen(mask, start_success):
    trainer = Trainer(SMALL.changed(goal_mask=mask, graph="d", meta_start_success=start_success))
    assert trainer.agents[META].is_learning == (start_success == 0)
    for _ in range(4):
        trainer.advance()
        assert not trainer.turns.ledger.illegal_goals.any()


def test_goals_are_drawn_at_random_until_enough_episodes_escape():
    trainer = Trainer(SMALL.changed(meta_start_success=0.02))
    agent, turns = trainer.agents[META], trainer.turns
    before = agent.state_dict()["learner"]["backend"]["network"]
    step, ended = turns.step(np.ones(8, int)), np.ones(8, bool)

    def all_ended(*, terminated):
        records = step.records.copy()
        records["option_ended"] = records["episode_ended"] = True
        records["terminated"], records["truncated"] = terminated, ~terminated
        records["success"] = terminated
        return Step(records, step.n_goals)

    lost = all_ended(terminated=~ended)
    for _ in range(12):
        agent.record(lost, turns)
    assert not agent.is_learning
    agent.record(all_ended(terminated=ended), turns)  # 8 of 104 escaped
    assert agent.is_learning
    assert agent.statistics["is_learning"] == 1
    agent.record(lost, turns)  # goals given before are none of its turns
    while np.isnan(agent.statistics["entropy"]):
        take_turns(agent, turns)
        agent.record(move(turns), turns)
    after = agent.state_dict()["learner"]["backend"]["network"]
    assert not equal(dict(before), dict(after))


@pytest.mark.parametrize("start_success", [0.0, 0.02])
def test_resumed_agent_equals_an_uninterrupted_one(start_success, tmp_path):
    config = SMALL.changed(meta_start_success=start_success)
    through, before, other = Trainer(config), Trainer(config), Trainer(config.changed(seed=1))
    for _ in range(8):
        through.advance()
        other.advance()
    for _ in range(4):
        before.advance()
    folder = RunFolder.create(tmp_path / "run", config)
    folder.save_checkpoint(before.state_dict())  # read with weights_only=True
    assert folder.config() == config
    after = Trainer(config)
    after.load_state_dict(folder.load_checkpoint())
    for _ in range(4):
        after.advance()
    assert equal(learned_state(through), learned_state(after))
    assert not equal(learned_state(through), learned_state(other))


def test_a_frozen_agent_plays_elsewhere_and_does_not_learn(tmp_path):
    trainer = Trainer(SMALL)
    for _ in range(4):
        trainer.advance()
    folder = RunFolder.create(tmp_path / "run", SMALL)
    folder.save_checkpoint(trainer.state_dict())
    before = learned_state(trainer)

    def goals(pair):
        turns, given = make_turns(SMALL, 3, 5, levels="evaluation"), []
        for _ in range(80):
            pair.step(turns)
            given.append(turns.goals.tolist())
        return given

    agent = load(folder.path)
    assert isinstance(agent.pair(3).agents[META], FrozenAgent)
    assert not hasattr(agent.pair(3).agents[META], "update")
    assert goals(agent.pair(3, seed=2)) == goals(trainer.freeze(3, seed=2))
    assert goals(agent.pair(3, seed=2)) != goals(agent.pair(3, seed=3))
    assert equal(before, learned_state(trainer))


def test_permuting_colours_permutes_the_logits():
    cardinalities = Features(WORLD, find_preset("learned").agents.meta_features, META).cardinalities
    network = GoalNetwork(AgentSpace(cardinalities, 14), 8, N_COLOURS)
    with torch.no_grad():
        for head in (network.colour_head, network.exit_head):
            head.weight.normal_()
    rng = np.random.default_rng(0)
    features = torch.from_numpy(rng.integers(0, cardinalities, (6, 5, 26)).astype(np.uint8))
    colours = rng.permutation(N_COLOURS)
    goals = np.concatenate([colours, FIRST_DOOR_GOAL + colours, [EXIT_GOAL]])
    permuted = features[..., np.concatenate([goals, N_GOALS + goals])]
    resets = torch.from_numpy(rng.random((6, 5)) < 0.3)
    state = network.initial_state(5)
    logits, values = network.sequence(features, state, resets)
    logits_too, values_too = network.sequence(permuted, state, resets)
    torch.testing.assert_close(logits[..., [*goals, N_GOALS]], logits_too)
    torch.testing.assert_close(values, values_too)
    assert logits.std() > 0.1
    for t in range(6):  # and a sequence is its steps
        state = torch.where(resets[t, :, None], network.initial_state(5), state)
        step_logits, step_values, state = network.step(features[t], state)
        torch.testing.assert_close(step_logits, logits[t])
        torch.testing.assert_close(step_values, values[t])


@pytest.mark.parametrize(("task", "are_alike"), [(None, True), ("workshop:4", False)])
def test_network_treats_colours_alike_but_not_items(task, are_alike):
    meta, _ = make_agents(find_preset("learned").changed(task=task, num_envs=4, threads=1))
    network, features = meta.learner.network, torch.zeros(1, meta.learner.space.n_features, dtype=torch.uint8)
    with torch.no_grad():
        logits, _, _ = network.step(features, network.initial_state(1))
    assert torch.isclose(logits[0, 0], logits[0, 1], rtol=1e-4, atol=0).item() == are_alike
