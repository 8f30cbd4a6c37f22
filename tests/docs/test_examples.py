"""Every example runs, the user code in the examples works as documented, and Algorithm 1 is in one file."""

import ast
import sys
from argparse import Namespace
from pathlib import Path

import chest_task
import numpy as np
import pytest
import torch
from children import run_python
from run_contents import check_picture, check_run
from turns_helpers import make as make_rooms

import hierroom
from hierroom.goals import N_GOALS
from hierroom.meta import take_turn
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trainer import Trainer
from hierroom.train import main as train
from hierroom.turns.records import CONTROLLER, META
from hierroom.turns.turns import Turns
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


FILE = EXAMPLES / "single_file.py"


@pytest.fixture
def single_file(one_thread):
    import single_file

    with torch.random.fork_rng(devices=[]):
        yield single_file


def settings(**others):
    return Namespace(**({"meta": "learned", "graph": "c", "steps": 600_000, "seed": 0} | others))


def test_single_file_has_at_most_300_lines():
    assert len(FILE.read_text().splitlines()) <= 300


@pytest.mark.slow
def test_single_file_imports_no_learner():
    imports = [node for node in ast.walk(ast.parse(FILE.read_text())) if isinstance(node, ast.ImportFrom | ast.Import)]
    names = {getattr(node, "module", None) or node.names[0].name for node in imports}
    others = {name.split(".")[0] for name in names} - set(sys.stdlib_module_names)
    assert others == {"hierroom", "numpy", "torch"}
    code = "import sys, single_file; print([n for n in sys.modules if n.startswith('hierroom.')])"
    loaded = ast.literal_eval(run_python("-c", code, cwd=EXAMPLES).stdout)
    assert "hierroom.turns.turns" in loaded
    assert not [name for name in loaded if name.startswith(("hierroom.learners", "hierroom.runs"))]


@pytest.mark.slow
def test_both_agents_learn_to_escape(single_file):
    few, many = settings(graph="a", steps=64), settings(graph="a", steps=200_000)
    untrained, trained = single_file.train(few), single_file.train(many)
    success, length = single_file.evaluate(many, trained)
    assert success >= 0.95
    for name in (META, CONTROLLER):
        _, without = single_file.evaluate(many, {**trained, name: untrained[name]})
        assert without > 1.2 * length, name


SKETCH = {"network": "policy_sketches:PolicySketches", "features": ("symbol", "view", "direction", "keys")}


@pytest.mark.parametrize("method", ["ppo-sketch", "hippo"])
def test_the_goal_picks_the_sub_policy(method):
    from policy_sketches import PolicySketches

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


@pytest.fixture
def asking():
    """Return a function that makes a meta-controller that keeps its questions and gets the same answer to each."""
    from asking_meta import AskingMeta

    def make(answer):
        questions = []
        return AskingMeta(lambda question: questions.append(question) or answer), questions

    return make


@pytest.mark.parametrize(
    ("answer", "goal", "not_understood"),
    [("I'd take the KEY.", 1, 0), ("a boat", 0, 1), ("coin or key", 0, 1), ("", 0, 1), ("the chest", 0, 1)],
)
def test_only_an_answer_naming_one_legal_goal_counts(answer, goal, not_understood, asking):
    turns, (meta, questions) = Turns(EnvConfig(task=chest_task.chest), 1, seed=0), asking(answer)
    take_turn(meta, turns)
    assert turns.goals.tolist() == [goal]
    assert questions[0].splitlines()[1:3] == ["Achieved so far: nothing.", "Goals that can be chosen: coin, key."]
    assert meta.statistics == {"asked": 1, "not_understood": not_understood}


def test_single_goal_is_not_asked_for_and_names_within_names_are_told_apart(asking):
    rooms, (meta, questions) = make_rooms("a", n=3), asking("?")
    take_turn(meta, rooms)
    assert (questions, (rooms.goals >= 0).all()) == ([], True)
    names = {1: "key 1", 12: "key 12", 2: "key 2"}
    assert [meta.named(text, names) for text in ("Key 12, please", "key 2", "key")] == [[12], [2], []]
