"""Entries that have no effect, and the warning about them."""

from pathlib import Path

import pytest

import hierroom
from hierroom.commands.evaluate import main as evaluate
from hierroom.commands.sweep import main as sweep
from hierroom.commands.watch import main as watch
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.config.presets import PRESETS, find_preset
from hierroom.runs.config.unread_entries import unread_entries, unread_note
from hierroom.train import main as train


@pytest.mark.parametrize(
    ("changes", "unread"),
    [
        ({}, ()),
        ({"novelty_bonus": 9.0}, ("novelty_bonus",)),
        ({"novelty_bonus": 9.0, "method": "ppo-novelty"}, ()),
        ({"curiosity_weight": 3.0}, ("curiosity_weight",)),
        ({"curiosity_weight": 3.0, "method": "ppo-rnd"}, ()),
        ({"meta_start_success": 0.9}, ("meta_start_success",)),
        ({"meta_start_success": 0.9, "meta": "learned"}, ()),
        ({"method": "ppo", "meta": "random"}, ("meta",)),
        ({"method": "ppo-bonus", "subgoal_horizon": 5, "goal_mask": "none"}, ("subgoal_horizon", "goal_mask")),
        ({"method": "ppo", "reward": "intrinsic", "meta": "random"}, ()),
        ({"method": "ppo", "reward": "own:Reward", "meta": "random"}, ()),
        ({"method": "ppo", "meta": "own:Meta", "goal_mask": "none"}, ()),
    ],
)
def test_unread_entries_lists_entries_without_effect(changes, unread):
    assert unread_entries(TrainConfig().changed(**changes)) == unread


@pytest.mark.parametrize("preset", PRESETS)
def test_entries_of_a_preset_are_not_reported(preset):
    assert unread_note(find_preset(preset)) is None


def test_commands_warn_of_unread_entries(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ["--steps", "300", "--size", "11", "--num-envs", "4", "--minibatches", "1", "--max-steps", "40"]
    assert train([*words, "--meta-ppo.gamma", "0.5", "--novelty-bonus", "9", "--out", "run"]) == 0
    said = "warning: meta_ppo.gamma, novelty_bonus have no effect on hippo with meta-controller fixed-dfs and reward "
    assert said + "intrinsic\n" in capsys.readouterr().err
    entries = {"steps": 300, "size": 11, "num_envs": 4, "minibatches": 1, "max_steps": 40, "evaluations": 0}
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


def test_evaluate_and_watch_warn_for_a_controller_without_goals(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ["--steps", "300", "--size", "11", "--num-envs", "4", "--minibatches", "1", "--max-steps", "40"]
    for method in ("ppo", "hippo"):
        assert train([*words, "--method", method, "--out", method]) == 0
    capsys.readouterr()
    warning = "warning: --meta has no effect on a controller of the method ppo\n"
    warning += "warning: --goal-mask has no effect on a controller of the method ppo\n"
    Path("ppo").rename("ppo\x1b[41m")
    for run, expected in (("ppo\x1b[41m", warning), ("hippo", "")):
        assert evaluate([run, "--episodes", "2", "--meta", "random", "--goal-mask", "none"]) == 0
        said = capsys.readouterr()
        assert said.err == expected
        assert said.out.startswith(run.replace("\x1b", "\\x1b") + " on graph")
        assert watch([run, "--text", "--meta", "random", "--goal-mask", "none"]) == 0
        assert capsys.readouterr().err == expected
