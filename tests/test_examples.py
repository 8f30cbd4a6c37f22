"""Every example runs as it stands."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from turns_rooms import achieve, goal_ids, make

from hierroom.training.presets import TrainConfig
from hierroom.training.run_folder import RunFolder
from hierroom.training.trainer import Trainer
from hierroom.world.kernels import KEY

EXAMPLES = Path(__file__).parents[1] / "examples"
SAYS = {
    "aec.py": "turns: {'meta_0': ",
    "parallel.py": "returns: {'meta_0': ",
    "gymnasium_vector.py": "steps a second",
    "trained_agent.py": "of the episode: exit",
    "warm_start.py": "began with the weights of the first",
    "supersuit_sb3.py": "2048 turns of both agents in 4 rooms",
}


def run(*arguments):
    done = subprocess.run([sys.executable, *arguments], cwd=EXAMPLES, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_example_is_run():
    own = {"own_meta_controller.py", "own_learning_meta.py", "own_network.py"}
    assert {path.name for path in EXAMPLES.glob("*.py")} == {*SAYS, *own}


@pytest.mark.parametrize("name", SAYS)
def test_example(name):
    assert SAYS[name] in run(name)


def test_the_meta_controller_of_ones_own_trains(tmp_path):
    """From a file outside the package, named on the command line."""
    room = ["--graph", "a", "--size", "11", "--rooms", "16", "--steps", "4000"]
    run("-m", "hierroom.train", "--meta", "own_meta_controller:NearestKeyFirst", *room, "--out", str(tmp_path / "run"))
    assert (tmp_path / "run" / "summary.json").is_file()


def test_the_learning_meta_controller_of_ones_own_learns_what_can_be_reached(tmp_path):
    room = ["--graph", "c", "--size", "11", "--rooms", "16", "--steps", "30000", "--max-steps", "200"]
    goals = ["--meta", "own_learning_meta:ReachedMostOften", "--goal-mask", "existing", "--subgoal-horizon", "30"]
    run("-m", "hierroom.train", *goals, *room, "--out", str(tmp_path / "run"))
    counts = RunFolder.open(tmp_path / "run").load_checkpoint()["meta"]
    rates = dict(enumerate((counts["reached"] / counts["tried"]).tolist()))
    door_without_key, door_with_key = (2 * kind + 1 for kind in (1, 2))  # both seen
    assert counts["tried"].sum() > 1000
    assert rates[door_without_key] < 0.2 < rates[door_with_key]
    assert "success" in run("-m", "hierroom.evaluate", str(tmp_path / "run"), "--episodes", "20")


def test_the_learning_meta_controller_of_ones_own_is_resumed_as_if_nothing_had_happened(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    config = TrainConfig(
        meta="own_learning_meta:ReachedMostOften", goal_mask="existing", graph="c", size=11, rooms=8, steps=4096
    )
    through, before = Trainer(config), Trainer(config)
    through.advance()
    before.advance()
    after = Trainer(config)
    after.load_state_dict(before.state_dict())
    for trainer in (through, after):
        for _ in range(3):
            trainer.advance()
    for ours, theirs in zip(through.meta.state_dict().values(), after.meta.state_dict().values(), strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_the_network_of_ones_own_trains(tmp_path):
    room = ["--graph", "a", "--size", "11", "--rooms", "16", "--steps", "4000"]
    run("-m", "hierroom.train", "--network", "own_network:GatedMemory", *room, "--out", str(tmp_path / "run"))
    assert (tmp_path / "run" / "summary.json").is_file()


def test_the_meta_controller_of_ones_own_chooses_the_nearest_key(monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    from own_meta_controller import NearestKeyFirst

    turns = make("e", 50, size=19)
    turns.ask(NearestKeyFirst())
    state, n_unequal = turns.world.state, 0
    for m in range(50):
        room, ways = state.levels[m], {}
        for colour in room.colours[:3].tolist():
            ((row, col),) = np.argwhere(state.grids[m] == KEY + colour)
            ways[colour] = abs(row - room.row) + abs(col - room.col)
        assert ways[int(turns.goals[m])] == min(ways.values())
        n_unequal += len(set(ways.values())) > 1
    assert n_unequal > 25

    alone = make("a")
    for name in ("k1", "d1", "x"):
        alone.ask(NearestKeyFirst())
        assert {int(alone.goals[0])} == goal_ids(alone, name)
        if name != "x":
            achieve(alone, name)
