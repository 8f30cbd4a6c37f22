"""Impossible states of turns, learners and trainers. A crafted file with such a state can have a valid digest."""

import re
from copy import deepcopy

import numpy as np
import pytest
import torch
from learner_envs import RandomEnvs, make_learner
from turns_helpers import make

from hierroom.agents.config import AgentsConfig
from hierroom.learners.config import PPOConfig
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.support.schema import as_array
from hierroom.worlds.env_config import EnvConfig

PPO = PPOConfig(sequence_length=4, minibatches=2, hidden_size=4)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("goals", 13, "turns.goals must be at most 12, not 13"),
        ("goals", -2, "turns.goals must be at least -1, not -2"),
        ("last_outcomes", 4, "turns.last_outcomes must be at most 3, not 4"),
        ("previous_actions", 10**7, "turns.previous_actions must be at most 5, not 10000000"),
        ("option_steps", -1, "turns.option_steps must be at least 0, not -1"),
        ("option_rewards", np.nan, "turns.option_rewards must be finite everywhere, not nan"),
        ("shortest", -2, "turns.shortest must be at least -1, not -2"),
    ],
)
def test_ledger_value_out_of_range_raises_input_error(name, value, said):
    turns = make(n=2)
    state = turns.get_state()
    state[name][1] = value
    with pytest.raises(InputError, match=f"^{said}"):
        turns.set_state(state)
    state[name] = state[name].astype(np.float32)
    with pytest.raises(InputError, match=rf"^turns\.{name} must be an array of \w+ and shape \(2,\), not of float32"):
        turns.set_state(state)


def test_levels_of_another_graph_raise_input_error():
    with pytest.raises(InputError, match=r"^a level is of another goal graph than is sampled here"):
        make("a", n=2).set_state(make("b", n=2).get_state())


@pytest.mark.parametrize(
    ("n_successes", "n_ended", "message"),
    [
        (4, [3, -1], "curriculum must hold no more successes than episodes ended, not 4"),
        (-1, [3, -1], "curriculum must hold no more successes than episodes ended, not -1"),
        (0, [100, 100], "n_ended must hold -1 to 100 episodes, and fewer in one environment at least"),
        (0, [101, 3], "n_ended must hold -1 to 100 episodes"),
        (0, [-2, 3], "n_ended must hold -1 to 100 episodes"),
    ],
)
def test_invalid_curriculum_counts_raise_input_error(n_successes, n_ended, message):
    turns = make("hitting_time:8..16", 2, curriculum_stages=2)
    state = turns.get_state()
    state["curriculum"][1], state["n_ended"][:] = n_successes, n_ended
    with pytest.raises(InputError, match=f"^{message}"):
        turns.set_state(state)


def learner_in_the_middle():
    learner, envs = make_learner(), RandomEnvs(6, seed=1)
    for _ in range(17):
        envs.tick(learner)
    envs.begin(learner)
    return learner


def put(name, place, value):
    def change(state):
        holder = state["rollout"]["arrays"] if name in state["rollout"]["arrays"] else state
        holder[name].view(-1)[place] = value

    return change


def change(path, value):
    def changed(state):
        *holders, key = path.split(".")
        for holder in holders:
            state = state[holder]
        state[key] = value

    return changed


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (put("features", 0, 255), "learner.rollout.arrays.features must be at most 4, not 255"),
        (put("actions", 5, 10**7), "learner.rollout.arrays.actions must be at most 3, not 10000000"),
        (put("elapsed", 0, 0), "learner.rollout.arrays.elapsed must be at least 1, not 0"),
        (put("rewards", 0, torch.inf), "learner.rollout.arrays.rewards must be finite everywhere, not inf"),
        (put("columns", 0, 12), "learner.rollout.arrays.columns must be at most 11, not 12"),
        (put("masks", slice(None), False), "the rollout of a learner cannot be used: the actions of its turns were"),
        (change("rollout.free", []), "the rollout of a learner cannot be used: each of its columns is free, full or"),
        (change("rollout.full", [12]), "learner.rollout.full[0] must be a whole number from 0 to 11, not 12"),
        (put("states", 0, torch.nan), "learner.states must be finite everywhere, not nan"),
        (change("states", torch.zeros(6, 4).to_sparse()), "learner.states must be an array, not a Tensor"),
        (change("backend.n_steps", -1), "learner.backend.n_steps must be a whole number from 0 to "),
        (change("backend.network", {}), "learner.backend.network lacks 'encoder."),
        (change("backend.network.more", 1), "learner.backend.network has the unknown 'more'"),
        (change("action_random.bit_generator", "MT19937"), "learner.action_random.bit_generator must be 'PCG64', not"),
        (change("shuffle_random", None), "learner.shuffle_random must be a mapping, not None"),
    ],
)
def test_an_invalid_state_of_a_learner_raises_input_error(spoil, said):
    learner = learner_in_the_middle()
    state = learner.state_dict()
    learner.load_state_dict(state)
    spoil(state)
    with pytest.raises(InputError, match=f"^{re.escape(said)}") as caught:
        learner.load_state_dict(state)
    assert "\n" not in str(caught.value)


def test_take_weights_refuses_non_finite_weights():
    learner = make_learner()
    state = learner.state_dict()
    state["backend"]["network"]["core.bias"][3] = torch.nan
    with pytest.raises(InputError, match=r"^learner.backend.network.core.bias must be finite everywhere, not nan$"):
        learner.take_weights(state)


def trainer_of(method="hippo", meta=None, **more):
    config = TrainConfig(EnvConfig("a", size=11), AgentsConfig(method, meta, **more), num_envs=4, ppo=PPO, meta_ppo=PPO)
    return Trainer(config)


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("turns.levels.row", torch.tensor([9, 9, 9, 10**6]).int(), "levels.row must be at most 14, not 1000000"),
        ("turns.levels.keys", torch.zeros(4), "levels.keys must be an array of int32 and shape (4,), not of float32"),
        ("turns.grids", torch.zeros(4, 21, 21), "grids must be an array of uint8 and shape (4, 21, 21), not of float6"),
        ("turns.3", torch.zeros(4), "turns has the unknown '3'"),
        ("turns.goals", "x", "turns.goals must be an array, not 'x'"),
        ("agents.controller_0.learner", [], "agents.controller_0: agent.learner must be a mapping, not a list"),
        ("agents.controller_0.description.features", "x", "agents.controller_0: agent.description.features must be"),
        ("agents.meta_0.warm_up.successes", [1], "agents.meta_0: warm_up.successes[0] must be True or False, not 1"),
        ("log.achieved", torch.tensor([[0, 1, 0], [3, 2, 13]]), "log.achieved must be at most 12, not 13"),
        ("log.achieved", torch.tensor([[4, 1, 0]]), "log.achieved must be at most 3, not 4"),
        ("log.achieved", torch.tensor([1]), "log.achieved must be an array of int64 and shape (1, 3), not of int64"),
        ("log.achieved", [], "log.achieved must be an array, not a list"),
        ("log.window.success", [2], "log.window.success[0] must be a whole number from 0 to 1, not 2"),
        ("log.steps_to", {7: 1}, "log has the unknown 'steps_to'"),
        ("log.returns", torch.full((4,), torch.nan).double(), "log.returns must be finite everywhere, not nan"),
    ],
)
def test_an_invalid_state_of_training_raises_input_error(path, value, said):
    trainer = trainer_of(meta="learned")
    state = trainer.state_dict()
    trainer.load_state_dict(state)
    if path == "turns.grids":
        value = value.double()
    change(path, value)(state)
    with pytest.raises(InputError, match=f"^{re.escape(said)}") as caught:
        trainer.load_state_dict(state)
    assert "\n" not in str(caught.value)


def test_begun_turn_at_a_turn_start_raises_input_error():
    trainer = trainer_of(meta="learned", meta_start_success=0.0)
    trainer.advance()
    state = trainer.state_dict()
    for name in trainer.agents:
        spoiled = deepcopy(state)
        rollout = spoiled["agents"][name]["learner"]["rollout"]
        if name == "meta_0":
            spoiled["turns"]["is_meta_turn"][:] = True
        else:
            rollout["arrays"]["columns"][0] = column = rollout["free"].pop()
            rollout["arrays"]["masks"][0, column] = rollout["arrays"]["is_open"][0] = True
        with pytest.raises(InputError, match=f"^agents.{name}: it is in a turn where it is about to begin one$"):
            trainer.load_state_dict(spoiled)


def test_an_invalid_state_of_curiosity_raises_input_error():
    trainer = trainer_of("ppo-rnd", features=("direction", "keys"))
    trainer.advance()
    for path, value, said in (
        ("counts", torch.zeros(16).double(), "distillation.counts must be at least 1, not 0.0"),
        ("growing", 10**9, "distillation.growing must be a whole number from 0 to 40, not 1000000000"),
        ("pending", [torch.full((4, 7), 9, dtype=torch.uint8)], "distillation.pending[0] must be at most 3, not 9"),
        ("adam.param_groups", [], "distillation.adam.param_groups must be "),
        ("adam.state", {0: {}}, "distillation.adam.state.0 lacks 'step', 'exp_avg', "),
    ):
        state = trainer.controller.curiosity.state_dict()
        trainer.controller.curiosity.load_state_dict(state)
        change(path, value)(state)
        with pytest.raises(InputError, match=f"^{re.escape(said)}"):
            trainer.controller.curiosity.load_state_dict(state)


def test_as_array_refuses_numbers_that_share_memory():
    """Writing one such number changes the others, and torch raises its error only at the write."""
    for shared in (
        torch.zeros(1).expand(4),
        torch.zeros(2, 1).expand(2, 3),
        torch.zeros(8).as_strided((3, 3), (2, 1)),
        np.broadcast_to(np.zeros(3), (2, 3)),
    ):
        with pytest.raises(InputError, match="a must be an array without numbers that share memory"):
            as_array(shared, "a")
    numbers = torch.arange(24.0).view(2, 3, 4)
    for apart in (numbers, numbers.permute(2, 0, 1), numbers[:, ::2], numbers[:0], torch.tensor(1.0)):
        assert as_array(apart, "a").tolist() == apart.tolist()
    reversed_rows = np.arange(6).reshape(2, 3)[::-1, ::-1]
    assert as_array(reversed_rows, "a") is reversed_rows
