"""A GPU learns what the CPU learns, up to rounding, and the same again from the same seed."""

import json
import signal
from pathlib import Path

import numpy as np
import pytest
import torch
from learner_envs import SPACE, RandomEnvs
from same_run import differences
from stopped_run import stop_at_update
from test_resume import FLAGS, LEARNED
from tiny_sweep import tiny_words

from hierroom.commands.sweep import main as sweep
from hierroom.learners.config import PPOConfig
from hierroom.learners.distillation import RandomNetworkDistillation
from hierroom.learners.ppo import Learner
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trainer import Trainer
from hierroom.train import main as train
from hierroom.turns.records import CONTROLLER

pytestmark = pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA device")

DEVICE = "cuda"
RUNS = {
    "fixed": [],
    "paper": ["--preset", "paper"],
    "curious": ["--method", "ppo-rnd"],
    "learned": LEARNED,
    "own": ["--network", "own_network:GatedMemory"],
}


@pytest.fixture(scope="module", params=RUNS)
def options(request) -> list[str]:
    return [*RUNS[request.param], "--graph", "a", *FLAGS, "--device", DEVICE]


@pytest.fixture(scope="module")
def run(options, tmp_path_factory) -> Path:
    """A run on the GPU from beginning to end."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(Path(__file__).parents[2] / "examples")
        out = tmp_path_factory.mktemp("gpu") / "run"
        assert train([*options, "--out", str(out)]) == 0
    return out


@pytest.fixture(autouse=True)
def examples(monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "examples")


def test_learner_on_gpu_matches_cpu():
    learners = [
        Learner(SPACE, 6, PPOConfig(sequence_length=5, minibatches=2, hidden_size=8), seed=1, device=device)
        for device in ("cpu", DEVICE)
    ]
    envs = [RandomEnvs(6, seed=1) for _ in learners]
    for _ in range(10):
        turns = [env.tick(learner) for env, learner in zip(envs, learners, strict=True)]
        np.testing.assert_array_equal(turns[0][2], turns[1][2])
        if turns[0][3]:
            assert turns[0][3] == pytest.approx(turns[1][3], rel=1e-3, abs=1e-5)


def test_distillation_on_gpu_matches_cpu():
    ours, other = (
        RandomNetworkDistillation((4, 3), 6, gamma=0.9, seed=1, hidden_size=16, device=device)
        for device in ("cpu", DEVICE)
    )
    random = np.random.default_rng(0)
    rewarded = 0
    for step in range(80):
        features = random.integers(0, (4, 3), (6, 2)).astype(np.uint8)
        rewards = ours.rewards(features)
        np.testing.assert_allclose(other.rewards(features), rewards, rtol=1e-3, atol=1e-5)
        rewarded += rewards.any()
        if step % 16 == 15:
            assert other.learn() == pytest.approx(ours.learn(), rel=1e-3)
    assert rewarded > 20


def test_the_same_seed_gives_the_same_run(options, run, tmp_path):
    assert train([*options, "--out", str(tmp_path / "run")]) == 0
    assert differences(run, tmp_path / "run") == []


@pytest.mark.parametrize("at", [2, 9])
def test_stopped_run_resumes_to_equal_files(at, options, run, tmp_path, monkeypatch):
    out = str(tmp_path / "run")
    stop_at_update(monkeypatch, signal.SIGINT, at)
    assert train([*options, "--out", out]) == 130
    assert train(["--resume", out, "--trust-run"]) == 0
    assert differences(run, Path(out)) == []


def test_a_run_moves_between_devices(run, tmp_path):
    config, state = RunFolder.open(run).config(), RunFolder.open(run).load_checkpoint()
    for device in ("cpu", DEVICE, "cpu"):
        trainer = Trainer(config.changed(device=device, steps=4096), begins=False)
        trainer.load_state_dict(state)
        trainer.advance()
        assert trainer.steps > state["steps"]
        state = trainer.state_dict()


def test_warm_start_copies_the_weights(run, options, tmp_path):
    assert train([*options, "--warm-start", str(run), "--out", str(tmp_path / "run")]) == 0
    found, expected = (
        RunFolder.open(path).load_checkpoint(steps)["agents"][CONTROLLER]["learner"]["backend"]["network"]
        for path, steps in ((tmp_path / "run", 0), (run, None))
    )
    assert all(torch.equal(found[name], tensor) for name, tensor in expected.items())


def test_provenance_names_the_gpu(run):
    sessions = json.loads((run / "provenance.json").read_text())["sessions"]
    assert [session["gpu"] for session in sessions] == [torch.cuda.get_device_name()]


def test_training_leaves_gpu_generator_and_memory_unchanged(run):
    trainer, before = Trainer(RunFolder.open(run).config().changed(steps=10**6)), torch.cuda.get_rng_state()
    memory = []
    for _ in range(12):
        trainer.advance()
        memory.append(torch.cuda.memory_allocated())
    assert torch.equal(torch.cuda.get_rng_state(), before)
    assert max(memory[8:]) <= max(memory[4:8])


def test_processes_of_a_sweep_share_the_gpu(tmp_path):
    out = tmp_path / "sweep"
    words = [*tiny_words("graph=a", f"device={DEVICE}"), "--seeds", "2", "--processes", "2", "--out", str(out)]
    assert sweep([*words, "--episodes", "4"]) == 0
    assert (out / "sweep.csv").read_text().count("\n") == 3
