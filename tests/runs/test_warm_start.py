"""A warm start copies the weights of another run's controller and nothing else."""

import json
import re
import sys
from pathlib import Path

import pytest
import torch

from hierroom.learners import ppo
from hierroom.learners.config import PPOConfig
from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.torch_backend import TorchBackend
from hierroom.runs.assembly import make_turns
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trained_agent import load
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.train import main as train
from hierroom.turns.records import CONTROLLER
from hierroom.worlds.env_config import EnvConfig

OWN = "own_network:GatedMemory"
sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))

SMALL = TrainConfig(EnvConfig("a", size=11, max_steps=60), num_envs=8, steps=1024, ppo=PPOConfig(minibatches=2))


@pytest.fixture(scope="module", params=["recurrent", pytest.param(OWN, marks=pytest.mark.slow)])
def run(request, tmp_path_factory) -> RunFolder:
    """A short run with a compiled or with a torch network."""
    config = SMALL.changed(network=request.param)
    trainer = Trainer(config)
    for _ in range(3):
        trainer.advance()
    folder = RunFolder.create(tmp_path_factory.mktemp("warm") / "run", config)
    folder.save_checkpoint(trainer.state_dict())
    return folder


def observed(trainer):
    return trainer.turns.observe(CONTROLLER, trainer.turns.due(CONTROLLER))


def test_warm_start_copies_only_the_weights(run):
    trained = run.load_checkpoint()["agents"][CONTROLLER]["learner"]
    config = run.config()
    config = config.changed(meta="random", graph="b", seed=5)
    warm, cold = Trainer(config.changed(warm_start=str(run.path))), Trainer(config)
    ours, other = warm.controller, cold.controller
    weights = ours.learner.network.state_dict()
    assert weights.keys() == trained["backend"]["network"].keys()
    assert all(torch.equal(weights[name], value) for name, value in trained["backend"]["network"].items())
    fresh, found = other.learner.state_dict(), ours.learner.state_dict()
    for name in ("action_random", "shuffle_random"):
        assert found[name] == fresh[name]
    assert warm.steps == 0
    features = ours.features.encode(observed(warm))
    assert (features == other.features.encode(observed(cold))).all()
    for trainer in (warm, cold):
        trainer.advance()
    assert any(not torch.equal(weights[name], value) for name, value in other.learner.network.state_dict().items())


def test_warm_started_controller_acts_like_its_source(run):
    warm = Trainer(run.config().changed(seed=5, warm_start=str(run.path)))
    trained = Trainer(run.config().changed(seed=5))
    trained.controller.load_state_dict(run.load_checkpoint()["agents"][CONTROLLER])
    observation = observed(warm)
    agents = [trainer.controller.frozen(8, seed=3) for trainer in (warm, trained)]
    for _ in range(5):
        first, second = (agent.act(observation) for agent in agents)
        assert (first == second).all()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"hidden_size": 32}, "with hidden_size 64, not 32"),
        ({"drop_key": True}, "with number of actions 5, not 6"),
        ({"method": "ppo"}, f"{' '.join(SMALL.agents.features[1:])}, not"),
        ({"features": ("view",)}, "with features "),
        ({"network": "other"}, "not other"),
    ],
)
def test_mismatched_warm_start_raises_input_error(run, change, said):
    if change.get("network"):
        change = {"network": {"recurrent": OWN, OWN: "recurrent"}[run.config().agents.network]}
        said = f"with network {run.config().agents.network}, not {change['network']}"
    with pytest.raises(InputError, match=re.escape(said)) as caught:
        Trainer(run.config().changed(**change, warm_start=str(run.path)))
    assert str(caught.value).startswith(f"{run.path} cannot warm-start this run: ")
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_warm_started_run_resumes_without_its_source(run, tmp_path):
    flags = ["--graph", "a", "--size", "11", "--max-steps", "60", "--num-envs", "8", "--minibatches", "2"]
    flags += ["--network", run.config().agents.network or "", "--warm-start", str(tmp_path / "before")]
    (tmp_path / "before").symlink_to(run.path)
    out = str(tmp_path / "run")
    assert train([*flags, "--steps", "512", "--out", out]) == 0
    (tmp_path / "before").unlink()
    assert train(["--resume", out, "--steps", "1024", "--trust-run"]) == 0
    folder = RunFolder.open(out)
    given = (folder.config(), TrainConfig.from_dict(json.loads(folder.load_checkpoint()["config"])))
    assert [config.warm_start for config in given] == [str(tmp_path / "before")] * 2


def test_run_trained_on_gpu_plays_on_cpu(tmp_path, monkeypatch):
    """A GPU trains through torch and the CPU plays with compiled kernels; their optimiser keeps other records."""
    config = SMALL.changed(device="cuda")
    with monkeypatch.context() as without_kernels:
        space = AgentSpace((1,), 5)
        without_kernels.setattr(ppo, "FusedBackend", lambda *arguments: TorchBackend(*arguments[:2], "cpu", space))
        trainer = Trainer(SMALL)
        for _ in range(2):
            trainer.advance()
    folder = RunFolder.create(tmp_path / "run", config)
    folder.save_checkpoint(trainer.state_dict())
    played = []
    for pair in (load(folder.path).pair(4, seed=1), trainer.freeze(4, seed=1)):
        turns = make_turns(SMALL, 4, seed=9, levels="evaluation")
        played.append([pair.step(turns).actions.tolist() for _ in range(40)])
    assert played[0] == played[1]
