"""Training with custom code, or with illegal goals: errors and warnings."""

import sys

import pytest

from hierroom.support.errors import InputError
from hierroom.train import main as train

FLAGS = ["--graph", "a", "--size", "11", "--max-steps", "60", "--num-envs", "8"]
FLAGS += ["--sequence-length", "16", "--minibatches", "2", "--epochs", "2", "--evaluations", "0", "--film", "False"]


def test_meta_controller_with_unsaved_memory_warns_at_start(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "forgets_of_test.py").write_text(
        "class Forgets:\n"
        "    def __init__(self):\n        self.given = []\n"
        "    def choose(self, observations, legal, situation):\n        return legal.argmax(axis=1)\n"
        "    def observe(self, step, turns):\n        self.given.append(step.goals)\n"
    )
    try:
        flags = [*FLAGS, "--steps", "512", "--meta", "forgets_of_test:Forgets", "--out", "run"]
        assert train(flags) == 0
    finally:
        sys.modules.pop("forgets_of_test", None)
    output = " ".join(capsys.readouterr().out.split())
    assert "the meta-controller forgets_of_test:Forgets has the method observe and attributes (given)" in output
    assert not (tmp_path / "run" / "evaluations.csv").exists()
    assert train([*FLAGS, "--steps", "512", "--out", "other"]) == 0
    assert "warning" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("    def state_dict(self):\n        return {'s': object()}\n", "cannot hold agents.meta_0.s, which is object"),
        ("    state_dict = None\n", "state_dict of a meta-controller is a method"),
        ("    def state_dict(self):\n        return [1]\n", "Expected `object`, got `array` - at `\\$.agents.meta_0`"),
        (
            "    def state_dict(self):\n        return {}\n"
            "    def load_state_dict(self, state):\n        self.mean = state['mean']\n",
            "could not be loaded again: agents.meta_0: the meta-controller Own cannot load its state: KeyError: 'mean'",
        ),
        ("    statistics = 5\n", "statistics of a meta-controller are numbers by name"),
    ],
)
def test_unsavable_meta_controller_is_refused_before_training(code, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = "class Own:\n    def choose(self, observations, legal, situation):\n        return legal.argmax(axis=1)\n"
    (tmp_path / "unsaved_of_test.py").write_text(text + "    def load_state_dict(self, state):\n        pass\n" + code)
    try:
        with pytest.raises(InputError, match=said):
            train([*FLAGS, "--steps", "512", "--meta", "unsaved_of_test:Own", "--out", "run"])
    finally:
        sys.modules.pop("unsaved_of_test", None)
    assert not (tmp_path / "run").exists()


def test_reward_failing_at_its_first_step_leaves_no_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "nan_of_test.py").write_text("def nan(step):\n    return step.extrinsic + float('nan')\n")
    try:
        with pytest.raises(InputError, match="must return finite numbers, not nan"):
            train([*FLAGS, "--steps", "512", "--reward", "nan_of_test:nan", "--out", "run"])
    finally:
        sys.modules.pop("nan_of_test", None)
    assert not (tmp_path / "run").exists()


def test_run_with_illegal_goals_warns(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "always_the_exit.py").write_text(
        "import numpy as np\n\nclass Exit:\n    def choose(self, observations, legal, situation):\n"
        "        return np.full(len(legal), 12)\n"
    )
    monkeypatch.setattr("sys.path", [str(tmp_path), *sys.path])
    assert train([*FLAGS, "--steps", "600", "--meta", "always_the_exit:Exit", "--out", "run"]) == 0
    assert "of the goals given in the episodes under way were not legal" in capsys.readouterr().err
    assert train([*FLAGS, "--steps", "600", "--out", "usual"]) == 0
    assert "were not legal" not in capsys.readouterr().err
