"""What a config takes, and what the presets hold."""

from dataclasses import replace

import pytest

from hierroom.errors import InputError
from hierroom.training.presets import PRESETS, TrainConfig
from hierroom.training.trainer import Trainer

CONFIG = TrainConfig(graph="a", size=11, max_steps=60, rooms=8, steps=2048)


def test_a_controller_is_not_told_of_goals_that_ended():
    with pytest.raises(InputError, match=r"^goal-outcome is .* one of meta_inputs, not of inputs$"):
        Trainer(replace(CONFIG, inputs=("view", "goal-outcome")))


def test_a_config_is_not_filled_up_with_defaults():
    table = CONFIG.to_dict()
    assert TrainConfig.from_dict(table) == CONFIG
    del table["ppo"]["gamma"]
    with pytest.raises(InputError, match=r"gamma missing$"):
        TrainConfig.from_dict(table)


def test_the_paper_preset_is_section_3_to_the_letter():
    paper = PRESETS["paper"]
    assert (paper.steps, paper.levels, paper.max_steps) == (10_000_000, 128, 1000)
    assert (paper.ppo.hidden_size, paper.ppo.learning_rate) == (64, 2.5e-4)
    assert (paper.ppo.gamma, paper.ppo.gae_lambda) == (0.9, 0.95)
    assert paper.inputs == ("view-ids", "goal")
