"""Entries that have no effect, and the warning about them."""

import warnings

import gymnasium
import pytest

import hierroom
from hierroom.commands.sweep import main as sweep
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.presets import PRESETS, find_preset
from hierroom.runs.config.unread_entries import unread_note
from hierroom.support.errors import warn_once
from hierroom.train import main as train


@pytest.mark.parametrize(
    ("changes", "unread"),
    [
        ({}, None),
        ({"novelty_bonus": 9.0}, "novelty_bonus has no effect on hippo with"),
        ({"novelty_bonus": 9.0, "method": "ppo-novelty"}, None),
        ({"curiosity_weight": 3.0}, "curiosity_weight has no effect on hippo with"),
        ({"curiosity_weight": 3.0, "method": "ppo-rnd"}, None),
        ({"meta_start_success": 0.9}, "meta_start_success has no effect on hippo with"),
        ({"meta_start_success": 0.9, "meta": "learned"}, None),
        ({"method": "ppo", "meta": "random"}, "meta has no effect on ppo with"),
        ({"method": "ppo", "subgoal_horizon": 5, "goal_mask": "none"}, "subgoal_horizon, goal_mask have no effect on"),
        ({"method": "ppo", "reward": "intrinsic", "meta": "random"}, None),
        ({"method": "ppo", "reward": "own:Reward", "meta": "random"}, None),
        ({"method": "ppo", "meta": "own:Meta", "goal_mask": "none"}, None),
        ({"evaluations": 0, "evaluation_episodes": 50}, "evaluation_episodes has no effect without evaluations"),
        ({"normalize_advantages": False, "min_advantage_std": 0.2}, "min_advantage_std has no effect without normal"),
        ({"pictures": "nature"}, "pictures has no effect without pictures in observations"),
        ({"scale_observations": True, "network": "own:Net"}, "scale_observations has no effect on a custom network"),
        ({"task": "chest_task:chest", "pictures": "nature", "scale_observations": True}, None),
        ({"task": "chest_task:chest", "pictures": "nature", "memory": "none"}, "pictures has no effect without pict"),
        ({"task": "chest_task:lake", "scale_observations": True}, "scale_observations has no effect without numbers"),
        ({"levels": "evaluation"}, "levels has no effect on training, which sets it"),
    ],
)
def test_unread_note_names_entries_without_effect(changes, unread):
    assert (unread_note(TrainConfig().changed(**changes)) or "None").startswith(str(unread))


@pytest.mark.parametrize(
    ("name", "value", "others"),
    [("novelty_bonus", 9.0, {"reward": "novelty"}), ("subgoal_horizon", 5, {"meta": "random"})],
)
def test_environments_warn_of_entries_without_effect(name, value, others):
    warn_once.cache_clear()
    for make in (gymnasium.make, gymnasium.make_vec):
        with pytest.warns(UserWarning, match=f"{name} has no effect with"):
            make("hierroom/EscapeRoom-a-v0", **{name: value})
        warn_once.cache_clear()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            make("hierroom/EscapeRoom-a-v0", **{name: value}, **others)


@pytest.mark.parametrize("preset", PRESETS)
def test_entries_of_a_preset_are_not_reported(preset):
    assert unread_note(find_preset(preset)) is None


def test_commands_warn_of_unread_entries(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ["--steps", "300", "--size", "11", "--num-envs", "4", "--minibatches", "1", "--max-steps", "40"]
    words += ["--evaluations", "0", "--film", "False"]
    assert train([*words, "--meta-ppo.gamma", "0.5", "--novelty-bonus", "9", "--out", "run"]) == 0
    said = "warning: meta_ppo.gamma, novelty_bonus have no effect on hippo with meta-controller fixed-dfs and reward "
    assert said + "intrinsic\n" in capsys.readouterr().err
    entries = {"steps": 300, "size": 11, "num_envs": 4, "minibatches": 1, "max_steps": 40, "evaluations": 0}
    entries["film"] = False
    hierroom.train(graph=("a", "keys-0-exit-1"), method="ppo", subgoal_horizon=7, out="from-python", **entries)
    said = capsys.readouterr().err
    assert "warning: subgoal_horizon has no effect on ppo" in said
    assert "keys-0-exit-1" in said.partition("subgoal_horizon")[0], "two graphs that are the same are reported, too"
    assert sweep(["meta_ppo.gamma=0.9,0.99", "method=hippo,ppo", "--list"]) == 0
    assert capsys.readouterr().err == "warning: meta_ppo.gamma is given, and has no effect on any run of the sweep\n"
    assert sweep(["novelty_bonus=0.1,0.2", "method=hippo,ppo-novelty", "--list"]) == 0
    assert capsys.readouterr().err == ""
    (tmp_path / "plan.toml").write_text('method = "hippo"\n[[variants]]\nname = "x"\nnovelty_bonus = 0.5\n')
    assert sweep(["plan.toml", "--list"]) == 0
    assert capsys.readouterr().err == "warning: novelty_bonus is given, and has no effect on any run of the sweep\n"
