"""Valid entries of a config, and the contents of the presets."""

import pytest

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.presets import PRESETS
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.worlds.env_config import EnvConfig

CONFIG = TrainConfig(EnvConfig("a", size=11, max_steps=60), num_envs=8, steps=2048)


def test_goal_outcome_as_controller_feature_raises_input_error():
    with pytest.raises(InputError, match=r"^goal-outcome belongs to meta_features, not to features$"):
        Trainer(CONFIG.changed(features=("view", "goal-outcome")))


def test_config_with_missing_entry_raises_input_error():
    table = CONFIG.to_dict()
    assert TrainConfig.from_dict(table) == CONFIG
    for part, entry in (("ppo", "gamma"), ("env", "subgoal_horizon")):
        lacking = {name: value for name, value in table[part].items() if name != entry}
        with pytest.raises(InputError, match=rf"missing required field `{entry}` - at `\$\.{part}`$"):
            TrainConfig.from_dict({**table, part: lacking})


def test_paper_preset_matches_section_3():
    paper = PRESETS["paper"]
    assert (paper.steps, paper.num_envs, paper.env.max_steps) == (10_000_000, 128, 1000)
    assert (paper.ppo.hidden_size, paper.ppo.learning_rate) == (64, 2.5e-4)
    assert (paper.ppo.gamma, paper.ppo.gae_lambda) == (0.9, 0.95)
    assert paper.agents.features == ("view-ids", "goal")


def test_ppo_with_goal_features_alone_raises_input_error():
    with pytest.raises(
        InputError, match=r"method ppo does not see goals, so features must name more than goal, symbol$"
    ):
        Trainer(CONFIG.changed(method="ppo", features=("goal", "symbol")))
