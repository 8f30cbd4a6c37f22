"""The network of a trained agent as a torch module, and exported for other programs."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest
import torch

import hierroom
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.trained_agent import TrainedAgent
from hierroom.runs.trainer import Trainer
from hierroom.turns.records import META

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
