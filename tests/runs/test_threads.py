"""Results depend neither on other threads of the process, which training leaves alone, nor on torch's defaults."""

import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from threading import Barrier, Event, Thread

import numpy as np
import pytest
import torch
from chest_task import Chest, chest
from same_run import differences
from same_state import equal
from torch import nn

import hierroom
from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic
from hierroom.learners.networks.encoder import FeatureEncoder
from hierroom.learners.networks.initial_weights import plain_torch, seeded_weights
from hierroom.runs.folder.checkpoint import from_bytes, to_bytes
from hierroom.runs.trained_agent import TrainedAgent
from hierroom.runs.trainer import Trainer
from hierroom.support.output import lasting_output
from hierroom.turns.records import META

SMALL = {"graph": "a", "size": 11, "num_envs": 16, "max_steps": 40, "evaluation_episodes": 8, "seed": 0, "log": "none"}
SPACE = AgentSpace((50, 70, 140), 5)
NETWORK = '''
import torch
from hierroom.learners.networks.actor_critic import RecurrentActorCritic

class Own(RecurrentActorCritic):
    """Draws in its constructor, uses dropout in training, and keeps the features of its last step."""

    def __init__(self, space, hidden_size):
        super().__init__(space, hidden_size)
        self.shift = torch.nn.Parameter(0.1 * torch.randn(space.n_actions))
        self.quiet = torch.nn.Dropout(0.5)

    def step(self, features, state):
        self.noted = features
        logits, values, state = super().step(self.noted, state)
        return self.quiet(logits) + self.shift, values, state

    def sequence(self, features, state, resets):
        logits, values = super().sequence(features, state, resets)
        return self.quiet(logits) + self.shift, values
'''


def run_together(*functions):
    """Start each function in its own thread at the same moment and return their results."""
    start = Barrier(len(functions))

    def begun(function):
        start.wait()
        return function()

    with ThreadPoolExecutor(len(functions)) as threads:
        return list(threads.map(begun, functions))


@pytest.fixture
def disturbed():
    """Another thread seeds torch, draws from it and sets its number of threads all the time."""
    ended = Event()

    def disturb():
        while not ended.is_set():
            torch.manual_seed(1)
            torch.rand(100)
            torch.set_num_threads(2)

    thread = Thread(target=disturb)
    thread.start()
    yield
    ended.set()
    thread.join()


class Drawn(nn.Module):
    """Draws its weights in many ways that users' networks use."""

    def __init__(self) -> None:
        super().__init__()
        layers = nn.LSTM(3, 4), nn.Conv2d(3, 4, 3), nn.MultiheadAttention(4, 2), nn.Embedding(3, 4)
        drawn = [torch.randn(4, 4), torch.rand(4), torch.empty(4, 4).normal_(), torch.normal(0.0, torch.ones(4))]
        drawn += [torch.randperm(4).float(), torch.randn_like(drawn[0])]
        drawn += [torch.distributions.Normal(0.0, 1.0).sample((4,))]
        self.layers, self.drawn = nn.ModuleList(layers), nn.ParameterList(drawn)
        nn.init.xavier_normal_(self.drawn[0])
        nn.init.sparse_(self.drawn[2], 0.5)


@pytest.mark.parametrize("make", [lambda: RecurrentActorCritic(SPACE, 64), Drawn])
def test_seeded_weights_do_not_depend_on_other_threads(make, one_thread, request):
    seed = np.random.SeedSequence(5)
    with torch.random.fork_rng([]):
        torch.manual_seed(int(seed.generate_state(1)[0]))
        expected = [*make().state_dict().values()]

    def drawn():
        with seeded_weights(seed):
            return [*make().state_dict().values()]

    request.getfixturevalue("disturbed")
    for _ in range(10):
        for weights in run_together(drawn, drawn, drawn):
            assert all(torch.equal(ours, theirs) for ours, theirs in zip(weights, expected, strict=True))


def test_seeded_weights_do_not_touch_the_global_generator(one_thread):
    torch.manual_seed(3)
    expected = torch.rand(4000)
    torch.manual_seed(3)
    ended = Event()

    def make_weights():
        while not ended.is_set():
            with seeded_weights(np.random.SeedSequence(0)):
                Drawn()

    thread = Thread(target=make_weights)
    thread.start()
    drawn = torch.cat([torch.rand(1) for _ in range(4000)])
    ended.set()
    thread.join()
    assert torch.equal(drawn, expected)


def test_lasting_output_restores_streams_in_any_order():
    before, entered = (sys.stdout, sys.stderr), Barrier(2)
    second_entered, first_left = Event(), Event()

    def first():
        with lasting_output():
            entered.wait()
            second_entered.wait()
        first_left.set()

    def second():
        entered.wait()
        with lasting_output():
            second_entered.set()
            first_left.wait()

    run_together(first, second)
    assert (sys.stdout, sys.stderr) == before


@pytest.fixture
def user_network(tmp_path, monkeypatch):
    (tmp_path / "drawn_in_threads.py").write_text(NETWORK)
    monkeypatch.syspath_prepend(tmp_path)
    return "drawn_in_threads:Own"


@pytest.mark.slow
@pytest.mark.parametrize(
    "entries", [{}, {"preset": "learned", "meta": "learned", "meta_start_success": 0.0}, {"method": "ppo-rnd"}]
)
def test_trainings_in_three_threads_equal_one_alone(tmp_path, entries):
    def train(name):
        hierroom.train(out=tmp_path / name / "run", steps=4096, evaluations=2, **SMALL, **entries)

    train("alone")
    run_together(*(lambda name=name: train(name) for name in "abc"))
    for name in "abc":
        assert differences(tmp_path / name / "run", tmp_path / "alone" / "run") == []


@pytest.mark.parametrize("agent", ["a", pytest.param("learned-g", marks=pytest.mark.slow), "own"])
def test_threads_sharing_an_agent_play_like_one(agent, tmp_path, user_network):
    if agent == "own":
        loaded = hierroom.train(out=tmp_path / "run", steps=128, network=user_network, minibatches=2, **SMALL)
    else:
        loaded = hierroom.load(agent)

    def play():
        config = hierroom.EnvConfig(graph="c", max_steps=60)
        return [episode.actions.tolist() for episode in hierroom.rollout(loaded, config, 12)]

    alone = play()
    with torch.autocast("cpu"):  # of this thread
        assert play() == alone
    for together in run_together(*[play] * 3):
        assert together == alone


RUNS = {
    "compiled": {"graph": "a"},
    "curious": {"graph": "a", "method": "ppo-rnd"},
    "learned meta": {"graph": "a", "meta": "learned", "meta_start_success": 0.0, "subgoal_horizon": 4},
    "torch": {"task": "chest_task:chest"},
    "own network": {"graph": "a", "network": "test_threads:Forgetful"},
}
SLOW = ("curious", "learned meta")


class Forgetful(nn.Module):
    """A network that does not say on which device its tensors are."""

    def __init__(self, space, hidden_size):
        super().__init__()
        self.encoder = FeatureEncoder(space.cardinalities, hidden_size)
        self.head = nn.Linear(hidden_size, space.n_actions, dtype=torch.float32)

    def initial_state(self, n):
        return torch.zeros(n, 1, dtype=torch.float32)

    def step(self, features, state):
        logits, values = self.sequence(features, state, None)
        return logits, values, state

    def sequence(self, features, state, resets):
        logits = self.head(self.encoder(features))
        return logits, logits.mean(-1) * torch.ones(1, dtype=torch.float32)


class Impolite(Chest):
    """A chest that leaves torch without gradients after each step."""

    def step(self, action):
        torch.set_grad_enabled(False)
        return super().step(action)


impolite = replace(chest, make=Impolite)


@contextmanager
def other_defaults():
    torch.set_default_device("meta")
    torch.set_default_dtype(torch.float64)
    try:
        with torch.inference_mode(), torch.autocast("cpu"):
            yield
    finally:
        torch.set_default_device(None)
        torch.set_default_dtype(torch.float32)


def results(path, **entries):
    """Train, resume from a checkpoint and train on, save and load the agent, and let it play."""
    tiny = {"num_envs": 4, "minibatches": 2, "sequence_length": 32, "max_steps": 30}
    config = hierroom.TrainConfig().changed(**tiny, **entries)
    with plain_torch():  # as `hierroom.train` does
        before, trainer = Trainer(config), Trainer(config)
        before.advance()
        trainer.load_state_dict(from_bytes(to_bytes(before.state_dict() | {"config": ""})))
        trainer.advance()
    agent = TrainedAgent(config, trainer.agents[META], trainer.controller, trainer.steps)
    agent.save(path)
    played = hierroom.rollout(hierroom.load(path, trust=True), episodes=2)
    return trainer.state_dict()["agents"], [episode.to_dict() for episode in played]


@pytest.mark.usefixtures("one_thread")
@pytest.mark.parametrize(
    "run", [*("compiled", "torch", "own network"), *(pytest.param(one, marks=pytest.mark.slow) for one in SLOW)]
)
def test_training_and_play_do_not_depend_on_torch_defaults(run, tmp_path):
    expected = results(tmp_path / "plain.safetensors", **RUNS[run])
    with other_defaults():
        found = results(tmp_path / "other.safetensors", **RUNS[run])
    assert equal(found, expected)


@pytest.mark.slow
@pytest.mark.usefixtures("one_thread")
def test_training_does_not_depend_on_gradient_mode_that_an_environment_leaves(tmp_path):
    expected, _ = results(tmp_path / "plain.safetensors", **RUNS["torch"])
    with torch.enable_grad():
        found, _ = results(tmp_path / "other.safetensors", task="test_threads:impolite")
    assert equal(found, expected)
