"""Sub-policies: each acts on its own symbol alone, and the bulk computation equals one turn at a time."""

import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from hierroom.goals import N_GOALS
from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.trainer import Trainer
from hierroom.turns.records import CONTROLLER, META
from hierroom.worlds.env_config import EnvConfig

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))
from policy_sketches import PolicySketches

N_SYMBOLS, HIDDEN = 4, 8
SPACE = AgentSpace((N_SYMBOLS, 5, 3), 6)


@pytest.fixture
def network():
    torch.manual_seed(0)
    return PolicySketches(SPACE, HIDDEN).double()


def features_of(*shape, seed=1):
    generator = torch.Generator().manual_seed(seed)
    of_numbers = [torch.randint(0, n, shape, generator=generator) for n in SPACE.cardinalities]
    return torch.stack(of_numbers, dim=-1).to(torch.uint8)


def test_symbol_selects_its_own_actor_critic(network):
    features, state = features_of(9), torch.randn(9, 2 * HIDDEN, dtype=torch.float64)
    logits, values, states = network.step(features, state)
    for n in range(9):
        part = network.parts[features[n, 0]]
        assert isinstance(part, RecurrentActorCritic)
        expected = part.step(features[n : n + 1, 1:], state[n : n + 1])
        for found, right in zip((logits, values, states), expected, strict=True):
            torch.testing.assert_close(found[n : n + 1], right)


SKETCH = {"network": "policy_sketches:PolicySketches", "features": ("symbol", "view", "direction", "keys")}


@pytest.mark.parametrize("method", ["ppo-sketch", "hippo"])
def test_the_goal_picks_the_sub_policy(method):
    config = TrainConfig(EnvConfig("a", size=11, max_steps=60), num_envs=8, steps=512)
    trainer = Trainer(config.changed(method=method, **SKETCH))
    turns, agent = trainer.turns, trainer.controller
    assert isinstance(agent.learner.network, PolicySketches)
    assert len(agent.learner.network.parts) == N_GOALS + 1
    situation = turns.observe(META, turns.due(META))
    turns.act(META, situation, trainer.agents[META].act(situation))
    assert (turns.goals >= 0).all()
    observation = turns.observe(CONTROLLER, turns.due(CONTROLLER))
    np.testing.assert_array_equal(agent.features.encode(observation)[:, 0], turns.goals)
    turns.ledger.write_fields({"goals": -1})
    observation = turns.observe(CONTROLLER, turns.due(CONTROLLER))
    assert (agent.features.encode(observation)[:, 0] == N_GOALS).all()
