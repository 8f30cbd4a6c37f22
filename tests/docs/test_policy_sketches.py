"""Sub-policies: the goal picks the one that acts."""

import sys
from pathlib import Path

import numpy as np
import pytest

from hierroom.goals import N_GOALS
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.trainer import Trainer
from hierroom.turns.records import CONTROLLER, META
from hierroom.worlds.env_config import EnvConfig

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))
from policy_sketches import PolicySketches

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
