"""`act` in a user's loop gives the actions of `hierroom.rollout`, in every API, and so do exported networks."""

from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch

import hierroom
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.trained_agent import TrainedAgent
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.turns.records import CONTROLLER, META

MAX_STEPS, N_EPISODES = 40, 3


def untrained(**changes):
    """An agent before its first update, with these entries of the config."""
    trainer = Trainer(TrainConfig().changed(num_envs=4, minibatches=2, **changes))
    return TrainedAgent(trainer.config, trainer.agents[META], trainer.controller, 0)


AGENTS = {
    "c": lambda: hierroom.load("c"),
    "workshop": lambda: untrained(task="workshop:6"),
    "arrays": lambda: untrained(task="chest_task:chest"),
    "no goals": lambda: untrained(method="ppo", graph="a"),
}


def entries(agent):
    return vars(agent.env(max_steps=MAX_STEPS, levels="evaluation"))


def played(agent, num_envs, *, greedy):
    """Return [(goals, actions)] of each environment by `hierroom.rollout`, N_EPISODES each."""
    agent = replace(agent, is_greedy=greedy)
    env = agent.env(max_steps=MAX_STEPS)
    episodes = hierroom.rollout(agent, env, N_EPISODES * num_envs, num_envs=num_envs, seed=5)
    of_envs = [([], []) for _ in range(num_envs)]
    for episode in episodes:
        of_envs[episode.env][0].extend(episode.goals.tolist())
        of_envs[episode.env][1].extend(episode.actions.tolist())
    return of_envs


def in_aec(agent, greedy):
    env, state, actions = hierroom.add_features(hierroom.env(**entries(agent)), agent, seed=5), None, []
    for n in range(N_EPISODES):
        env.reset(seed=5 if n == 0 else None)
        for name in env.agent_iter():
            observation, _, terminated, truncated, info = env.last()
            if terminated or truncated:
                env.step(None)
                continue
            begins = info["length"] == 0
            action, state = agent.act(observation, state, begins=begins, greedy=greedy, seed=5)
            if name == CONTROLLER:
                actions.append(action)
            env.step(action)
    return actions


def in_parallel(agent, greedy):
    env, state, actions = hierroom.add_features(hierroom.parallel_env(**entries(agent)), agent, seed=5), None, []
    for n in range(N_EPISODES):
        observations, infos = env.reset(seed=5 if n == 0 else None)
        while env.agents:
            begins = infos[META]["length"] == 0
            chosen, state = agent.act(observations, state, begins=begins, greedy=greedy, seed=5)
            actions.append(chosen[CONTROLLER])
            observations, _, _, _, infos = env.step(chosen)
    return actions


def in_gymnasium(agent, greedy):
    meta = agent.meta_controller(seed=5)
    made = gymnasium.make("hierroom/EscapeRoom-v0", meta=meta, **entries(agent))
    env, state, actions = hierroom.add_features(made, agent), None, []
    for n in range(N_EPISODES):
        observation, info = env.reset(seed=5 if n == 0 else None)
        is_over = False
        while not is_over:
            begins = info["length"] == 0
            action, state = agent.act(observation, state, begins=begins, greedy=greedy, seed=5)
            actions.append(action)
            observation, _, terminated, truncated, info = env.step(action)
            is_over = terminated or truncated
    return actions


@pytest.mark.parametrize(
    ("play", "name"),
    [
        *((play, "c") for play in (in_aec, in_parallel, in_gymnasium)),
        (in_aec, "workshop"),
        (in_parallel, "no goals"),
        pytest.param(in_gymnasium, "arrays", marks=pytest.mark.slow),
    ],
)
def test_act_in_one_environment_matches_rollout(play, name):
    agent = AGENTS[name]()
    for greedy in (False, True):
        ((_, expected),) = played(agent, 1, greedy=greedy)
        assert play(agent, greedy) == expected
        assert greedy or len(set(expected)) > 2


@pytest.mark.parametrize("play", [in_aec, in_parallel])
def test_act_of_learned_meta_controller_matches_rollout(play):
    agent = hierroom.load("learned-g")
    ((goals, expected),) = played(agent, 1, greedy=False)
    assert play(agent, False) == expected
    assert len(set(goals)) > 2


@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_act_in_vector_environment_matches_rollout(mode):
    """Sampled actions in SameStep mode alone: in NextStep mode `act` also draws for the steps that only reset."""
    agent, n, greedy = hierroom.load("c"), 4, mode == "NextStep"
    expected = played(agent, n, greedy=greedy)
    meta = agent.meta_controller(n, seed=5)
    made = gymnasium.make_vec("hierroom/EscapeRoom-v0", n, meta=meta, autoreset_mode=mode, **entries(agent))
    env, state, found = hierroom.add_features(made, agent), None, [[] for _ in range(n)]
    observations, infos = env.reset(seed=5)
    have_ended = np.zeros(n, bool)
    while any(len(ours) < len(theirs) for ours, (_, theirs) in zip(found, expected, strict=True)):
        begins = infos["length"] == 0
        actions, state = agent.act(observations, state, begins=begins, greedy=greedy, seed=5)
        for one in np.flatnonzero(~have_ended):
            found[one].append(int(actions[one]))
        observations, _, terminated, truncated, infos = env.step(actions)
        if mode == "NextStep":
            have_ended = terminated | truncated
    for ours, (_, theirs) in zip(found, expected, strict=True):
        assert ours[: len(theirs)] == theirs


def test_act_leaves_its_state_unchanged_and_respects_masks():
    agent = hierroom.load("c")
    env = hierroom.add_features(gymnasium.make("hierroom/EscapeRoom-v0", **entries(agent)), agent)
    observation, _ = env.reset(seed=0)
    _, state = agent.act(observation, greedy=True)
    first, later = agent.act(observation, state, greedy=True)
    for same in (state, deepcopy(state)):
        again, _ = agent.act(observation, same, greedy=True)
        assert first == again
    np.testing.assert_array_equal(state.next(np.zeros(1, bool))._states, state._states)
    assert (later._states != state._states).any()
    probabilities = later.decision.probabilities
    assert probabilities.shape == (1, 5)
    assert probabilities.argmax() == first
    for action in range(5):
        only = np.arange(5) == action
        assert agent.act({**observation, "action_mask": only.astype(np.int8)}, state)[0] == action


def test_invalid_act_arguments_raise_input_error():
    agent = hierroom.load("c")
    plain = gymnasium.make("hierroom/EscapeRoom-v0", **entries(agent))
    env = hierroom.add_features(plain, agent)
    observation, _ = env.reset(seed=0)
    _, state = agent.act(observation)
    many = {"features": np.zeros((2, len(observation["features"])), np.int64)}
    cases: tuple[tuple[tuple[Any, ...], dict[str, Any], str], ...] = (
        ((plain.reset(seed=0)[0],), {}, "these observations hold .*, and no features: wrap the environment by"),
        ((7,), {}, "observations must be dicts, not 7"),
        (({"features": [0.5]},), {}, "the agent reads .* whole numbers of each environment, not float64 of shape"),
        (({"features": observation["features"] - 99},), {}, "features are numbers from 0 to 255, not from -99 to"),
        (({"features": observation["features"] + 99},), {}, "feature 0 must be below"),
        ((many, state), {}, "the state has 1 environments, but the observations have 2"),
        ((observation, 7), {}, "the state must come from the last act, or be None, not 7"),
        ((observation, hierroom.load("a").act(observation)[1]), {}, "the state comes from another agent"),
        ((observation, state), {"begins": [True, False]}, "begins must be True, False or 1 of them, not bool of shape"),
        ((observation,), {"seed": -1}, "seed must be at least 0, not -1"),
        (({**observation, "action_mask": np.zeros(5, np.int8)},), {}, "environment 0 has no legal action"),
    )
    for arguments, named, message in cases:
        with pytest.raises(InputError, match=message):
            agent.act(*arguments, **named)
    for env in (hierroom.env(drop_key=True), gymnasium.make_vec("hierroom/EscapeRoom-v0", 2, drop_key=True)):
        with pytest.raises(InputError, match="the agent was trained in environments with other actions"):
            hierroom.add_features(env, agent)


EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(params=["c", "chest_task:chest", "own_network:GatedMemory"])
def agent(request, monkeypatch):
    """A shipped agent, and two untrained ones: on arrays, and with a user's network."""
    if request.param == "c":
        return hierroom.load("c")
    monkeypatch.syspath_prepend(EXAMPLES)
    what = {"task": request.param} if "task" in request.param else {"network": request.param}
    trainer = Trainer(TrainConfig().changed(num_envs=4, minibatches=2, **what))
    return TrainedAgent(trainer.config, trainer.agents[META], trainer.controller, 0)


def agrees_step_by_step(agent, n, step):
    """Let ``step(features, state)``, of arrays, and the agent play side by side in n environments."""
    made = gymnasium.make_vec("hierroom/Task-v0", n, **vars(agent.env(max_steps=20)))
    env, state = hierroom.add_features(made, agent), None
    observations, infos = env.reset(seed=1)
    memory = start = agent.network.initial_state(n).detach().numpy()
    for _ in range(30):  # with ends of episodes
        begins = infos["length"] == 0
        actions, state = agent.act(observations, state, begins=begins, greedy=True)
        memory = np.where(begins[:, None], start, memory)
        logits, values, memory = step(observations["features"].astype(np.uint8), memory)
        np.testing.assert_allclose(logits, state.decision.logits, atol=2e-5)
        np.testing.assert_allclose(values, state.decision.values, atol=2e-5)
        observations, _, _, _, infos = env.step(actions)


def module_step(module):
    def step(features, memory):
        with torch.no_grad():
            return [output.numpy() for output in module(torch.from_numpy(features), torch.from_numpy(memory))]

    return step


def test_agent_network_matches_act(agent):
    network = agent.network
    assert isinstance(network, torch.nn.Module)
    assert not network.training
    agrees_step_by_step(agent, 3, module_step(network))
    with torch.no_grad():
        for weights in network.parameters():
            weights.zero_()
    assert all(bool(weights.any()) for weights in agent.controller.learner.network.parameters() if weights.ndim > 1)


@pytest.mark.slow
def test_exported_network_matches_act(agent):
    n, n_features = torch.export.Dim("n", min=1), len(agent.controller.features.cardinalities)
    inputs = torch.zeros(2, n_features, dtype=torch.uint8), agent.network.initial_state(2)
    with torch.no_grad():
        program = torch.export.export(agent.network, inputs, dynamic_shapes=({0: n}, {0: n}))
    for n_envs in (1, 3):
        agrees_step_by_step(agent, n_envs, module_step(program.module()))
