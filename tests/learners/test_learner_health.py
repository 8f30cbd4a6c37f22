"""A learner names diverging numbers before they reach a checkpoint."""

import re
from copy import deepcopy

import numpy as np
import pytest
import torch
from learner_envs import PlainTorchNetwork, RandomEnvs, make_learner
from same_state import equal

from hierroom.learners import distillation, ppo
from hierroom.learners.health import LIMIT, check_health
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trainer import Trainer
from hierroom.support import cli
from hierroom.support.errors import DivergenceError, InputError
from hierroom.train import main as train

FLAGS = ["--graph", "a", "--size", "11", "--max-steps", "60", "--num-envs", "8", "--evaluations", "0"]
FLAGS += ["--sequence-length", "16", "--minibatches", "2", "--epochs", "2"]


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 2 * LIMIT, -2 * LIMIT])
@pytest.mark.parametrize("make", [np.asarray, torch.tensor], ids=["array", "tensor"])
def test_check_health_finds_one_wrong_number(make, wrong):
    for place in range(6):
        numbers = np.zeros(6, np.float32)
        numbers[place] = wrong
        with pytest.raises(DivergenceError, match=r"^second \(.* in 1 of 6 numbers\); rest$"):
            check_health([("first", make(np.ones(2))), ("second", make(numbers.reshape(2, 3)))], "rest")


def test_check_health_accepts_large_whole_and_empty_arrays():
    whole = torch.tensor([2**62])
    check_health([("a", np.array([0.99e15, -0.99e15])), ("b", torch.empty(0)), ("c", whole), ("d", np.zeros(0))], "")


def learn(learner):
    envs = RandomEnvs(6, seed=0)
    for _ in range(300):
        envs.tick(learner)


class Spoiled(PlainTorchNetwork):
    place, left = "", 0

    def step(self, features, states):
        logits, values, states = super().step(features, states)
        self.left -= 1
        factor = float("nan") if self.left < 0 else 1.0
        return (
            logits * (factor if self.place == "log_probs" else 1.0),
            values * (factor if self.place == "values" else 1.0),
            states * (factor if self.place == "recurrent states" else 1.0),
        )


@pytest.mark.parametrize("place", ["log_probs", "values", "recurrent states"])
def test_batch_with_nan_raises_divergence_error_before_the_update(place):
    learner = make_learner(network=Spoiled)
    learner.network.place, learner.network.left = place, 30
    train_once = learner._backend.train

    def saving(*arguments):
        means = train_once(*arguments)
        learner.saved = {name: tensor.clone() for name, tensor in learner.network.state_dict().items()}  # ty: ignore
        return means

    learner._backend.train = saving  # ty: ignore
    with pytest.raises(DivergenceError, match=rf"^({place}|values|log_probs) \(nan in"):
        learn(learner)
    assert all(torch.equal(tensor, learner.saved[name]) for name, tensor in learner.network.state_dict().items())


def test_too_large_rewards_raise_divergence_error():
    learner = make_learner()
    finish = learner.finish
    learner.finish = lambda envs, rewards, *rest: finish(envs, rewards * 0 + 1e300, *rest)  # ty: ignore
    with pytest.raises(DivergenceError, match=r"^rewards \(inf in .*; make the rewards smaller$"):
        learn(learner)


@pytest.mark.parametrize("clone", [lambda learner: learner, deepcopy], ids=["itself", "a copy"])
@pytest.mark.parametrize("network", [None, PlainTorchNetwork], ids=["compiled", "torch"])
def test_weights_spoiled_by_an_update_raise_divergence_error(network, clone):
    learner = clone(make_learner(network=network, learning_rate=1e30, epochs=1, minibatches=1))
    with pytest.raises(DivergenceError, match=r"^weights \S+ \(.*; a learning_rate below 1e\+30"):
        learn(learner)


@pytest.mark.parametrize("network", [None, PlainTorchNetwork], ids=["compiled", "torch"])
def test_weights_with_too_large_outputs_raise_divergence_error(network):
    learner = make_learner(network=network, epochs=1, minibatches=1)
    train_once = learner._backend.train

    def spoiled(*arguments):
        means = train_once(*arguments)
        with torch.no_grad():
            for tensor in learner.network.parameters():
                tensor.fill_(9e14)
        return means

    learner._backend.train = spoiled  # ty: ignore
    with pytest.raises(DivergenceError, match=r"^(logits|values) \("):
        learn(learner)


@pytest.mark.parametrize("settings", [{}, {"method": "ppo-rnd"}, {"meta": "learned", "meta_start_success": 0.0}])
def test_health_checks_do_not_change_training(monkeypatch, settings):
    small = {"graph": "a", "size": 11, "max_steps": 60, "num_envs": 8, "sequence_length": 16, "minibatches": 2}
    config = TrainConfig().changed(**small, epochs=2, steps=1024, **settings)
    states = []
    for is_checked in (True, False):
        if not is_checked:
            for name in ("check_start", "check_batch", "check_update"):
                monkeypatch.setattr(ppo, name, lambda *_: None)
            monkeypatch.setattr(distillation, "check_health", lambda *_: None)
        trainer = Trainer(config)
        while not trainer.is_done:
            trainer.advance()
        states.append(trainer.state_dict()["agents"])
    assert equal(*states)


class Unborn(PlainTorchNetwork):
    def __init__(self, space, hidden_size):
        super().__init__(space, hidden_size)
        with torch.no_grad():
            next(self.parameters()).view(-1)[3] = float("nan")


def test_a_network_that_starts_with_nan_is_refused():
    with pytest.raises(InputError, match=r"^Unborn: \S+ \(nan in 1 of .*start with finite weights$"):
        make_learner(network=Unborn)


@pytest.mark.parametrize("steps", [pytest.param(0, marks=pytest.mark.slow), 1024])
def test_diverging_run_keeps_its_last_good_checkpoint(tmp_path, monkeypatch, capsys, steps):
    advance, out = Trainer.advance, tmp_path / "my run"

    def diverging(self):
        advance(self)
        if self.steps >= steps:  # from now on each update spoils the weights, while its losses stay finite
            object.__setattr__(self.controller.learner.config, "learning_rate", 1e30)

    monkeypatch.setattr(Trainer, "advance", diverging)
    with pytest.raises(SystemExit) as ended:
        cli.run(lambda: train([*FLAGS, "--steps", "4096", "--epochs", "1", "--minibatches", "1", "--out", str(out)]))
    assert ended.value.code == 1
    said = capsys.readouterr().err
    kept = RunFolder.open(out).load_checkpoint()
    start = f" --warm-start '{out}'" if steps else ""
    assert re.fullmatch(
        rf"error: training diverged after [\d,]+ steps in controller_0's weights \S+ \(.*\); a learning_rate below "
        rf"1e\+30, .*\. The checkpoint after {kept['steps']:,} steps is kept; begin again with --config "
        rf"'{out}/config\.json'{start} and what is to change\n",
        said,
    )
    assert bool(kept["steps"]) == bool(steps)
    for name, tensor in kept["agents"]["controller_0"]["learner"]["backend"]["network"].items():
        check_health([(name, tensor)], "")
    monkeypatch.undo()
    again = ["--config", f"{out}/config.json", "--steps", "512", "--out", str(tmp_path / "again")]
    assert train([*again, *(["--warm-start", str(out)] if steps else [])]) == 0
