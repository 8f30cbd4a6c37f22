"""Results do not depend on the user's defaults of torch: device, type of numbers, and gradients."""

from contextlib import contextmanager
from dataclasses import replace

import pytest
import torch
from chest_task import Chest, chest
from same_state import equal
from torch import nn

import hierroom
from hierroom.learners.networks.encoder import FeatureEncoder
from hierroom.learners.networks.initial_weights import plain_torch
from hierroom.runs.folder.checkpoint import from_bytes, to_bytes
from hierroom.runs.trained_agent import TrainedAgent
from hierroom.runs.trainer import Trainer
from hierroom.turns.records import META

RUNS = {
    "compiled": {"graph": "a"},
    "curious": {"graph": "a", "method": "ppo-rnd"},
    "learned meta": {"graph": "a", "meta": "learned", "meta_start_success": 0.0, "subgoal_horizon": 4},
    "torch": {"task": "chest_task:chest"},
    "own network": {"graph": "a", "network": "test_torch_defaults:Forgetful"},
}
SLOW = ("curious", "learned meta")


class Forgetful(nn.Module):
    """A network that does not say on which device its tensors are."""

    def __init__(self, space, hidden_size):
        super().__init__()
        self.encoder = FeatureEncoder(space.cardinalities, hidden_size)
        self.head = nn.Linear(hidden_size, space.n_actions, dtype=torch.float32)

    def initial_state(self, n):
        return torch.zeros(n, 1, dtype=torch.float32)

    def step(self, features, state):
        logits, values = self.sequence(features, state, None)
        return logits, values, state

    def sequence(self, features, state, resets):
        logits = self.head(self.encoder(features))
        return logits, logits.mean(-1) * torch.ones(1, dtype=torch.float32)


class Impolite(Chest):
    """A chest that leaves torch without gradients after each step."""

    def step(self, action):
        torch.set_grad_enabled(False)
        return super().step(action)


impolite = replace(chest, make=Impolite)


@contextmanager
def other_defaults():
    torch.set_default_device("meta")
    torch.set_default_dtype(torch.float64)
    try:
        with torch.inference_mode(), torch.autocast("cpu"):
            yield
    finally:
        torch.set_default_device(None)
        torch.set_default_dtype(torch.float32)


def results(path, **entries):
    """Train, resume from a checkpoint and train on, save and load the agent, and let it play."""
    tiny = {"num_envs": 4, "minibatches": 2, "sequence_length": 32, "max_steps": 30}
    config = hierroom.TrainConfig().changed(**tiny, **entries)
    with plain_torch():  # as `hierroom.train` does
        before, trainer = Trainer(config), Trainer(config)
        before.advance()
        trainer.load_state_dict(from_bytes(to_bytes(before.state_dict() | {"config": ""})))
        trainer.advance()
    agent = TrainedAgent(config, trainer.agents[META], trainer.controller, trainer.steps)
    agent.save(path)
    played = hierroom.rollout(hierroom.load(path, trust=True), episodes=2)
    return trainer.state_dict()["agents"], [episode.to_dict() for episode in played]


@pytest.mark.usefixtures("one_thread")
@pytest.mark.parametrize(
    "run", [*("compiled", "torch", "own network"), *(pytest.param(one, marks=pytest.mark.slow) for one in SLOW)]
)
def test_training_and_play_do_not_depend_on_torch_defaults(run, tmp_path):
    expected = results(tmp_path / "plain.safetensors", **RUNS[run])
    with other_defaults():
        found = results(tmp_path / "other.safetensors", **RUNS[run])
    assert equal(found, expected)


@pytest.mark.slow
@pytest.mark.usefixtures("one_thread")
def test_training_does_not_depend_on_gradient_mode_that_an_environment_leaves(tmp_path):
    expected, _ = results(tmp_path / "plain.safetensors", **RUNS["torch"])
    with torch.enable_grad():
        found, _ = results(tmp_path / "other.safetensors", task="test_torch_defaults:impolite")
    assert equal(found, expected)
