"""Every example runs, and the user code in the examples works as documented."""

from pathlib import Path

import numpy as np
import pytest
from children import run_python
from run_contents import check_picture, check_run

import hierroom
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trainer import Trainer
from hierroom.train import main as train
from hierroom.turns.records import META
from hierroom.worlds.env_config import EnvConfig

EXAMPLES = Path(__file__).parents[2] / "examples"
SHORT = ["--size", "11", "--num-envs", "16", "--evaluations", "2", "--evaluation-episodes", "20"]
SAYS = {
    "aec.py": "turns: {'meta_0': ",
    "parallel.py": "returns: {'meta_0': ",
    "gymnasium_vector.py": "steps a second",
    "trained_agent.py": "of 100 episodes escaped, in ",
    "warm_start.py": "began with the weights of the first",
    "supersuit_sb3.py": "2048 turns of both agents in 4 environments",
    "asking_meta.py": " of 5 episodes escaped, ",
}
OWN = {
    "own_meta_controller:nearest": "meta",
    "own_reward:Closer": "reward",
    "own_meta_controller:NearestKeyFirst": "meta",
    "own_reward:hurry": "reward",
    "own_network:GatedMemory": "network",
}


@pytest.fixture(autouse=True)
def in_examples(monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)


def test_every_example_is_tested():
    own = {f"{spec.partition(':')[0]}.py" for spec in OWN} | {"own_learning_meta.py", "own_watching_meta.py"}
    elsewhere = {"single_file.py", "policy_sketches.py", "my_tasks.py"}
    assert {path.name for path in EXAMPLES.glob("*.py")} == {*SAYS, *own, *elsewhere}


@pytest.mark.slow
@pytest.mark.parametrize("name", SAYS)
def test_an_example_runs(name):
    done = run_python(name, cwd=EXAMPLES)
    assert done.returncode == 0, done.stderr
    assert SAYS[name] in done.stdout


@pytest.mark.parametrize("spec", [pytest.param(spec, marks=[pytest.mark.slow] * (n > 0)) for n, spec in enumerate(OWN)])
def test_user_code_trains_is_resumed_and_plays(spec, tmp_path):
    out, kind = tmp_path / "run", OWN[spec]
    own = [f"--{kind}", spec]
    assert train([*SHORT, *own, "--graph", "a", "--steps", "2000", "--max-steps", "50", "--out", str(out)]) == 0
    assert check_run(out)["steps"] == 2048  # 4 updates
    check_picture(out)
    assert RunFolder.open(out).config().entries[kind] == spec
    assert train([*own, "--resume", str(out), "--steps", "2500"]) == 0
    assert len(list(hierroom.rollout(hierroom.load(out, trust=True), episodes=2))) == 2


@pytest.mark.slow
def test_learning_meta_learns_which_goals_are_reachable(tmp_path):
    goals = {"meta": "own_learning_meta:ReachedMostOften", "goal_mask": "existing", "subgoal_horizon": 30}
    sizes = {"size": 11, "num_envs": 16, "max_steps": 200, "steps": 30_000, "evaluations": 0, "log": "none"}
    hierroom.train(graph="c", out=tmp_path / "run", **sizes, **goals)
    counts = RunFolder.open(tmp_path / "run").load_checkpoint()["agents"][META]
    rates = dict(enumerate((counts["reached"] / counts["tried"]).tolist()))
    door_without_key, door_with_key = (2 * kind + 1 for kind in (1, 2))  # both seen
    assert counts["tried"].sum() > 1000
    assert rates[door_without_key] < 0.2 < rates[door_with_key]


@pytest.mark.parametrize("meta", ["own_learning_meta:ReachedMostOften", "own_watching_meta:OthersFirst"])
def test_a_meta_controller_with_a_memory_is_resumed_exactly(meta):
    env = EnvConfig("c", size=11, goal_mask="existing", subgoal_horizon=20)
    config = TrainConfig(env, num_envs=8, steps=4096).changed(meta=meta)
    through, before = Trainer(config), Trainer(config)
    through.advance()
    before.advance()
    after = Trainer(config)
    after.load_state_dict(before.state_dict())
    for trainer in (through, after):
        for _ in range(3):
            trainer.advance()
    ours, theirs = (trainer.agents[META].state_dict().values() for trainer in (through, after))
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(one, other)
        assert np.any(np.asarray(one))
