"""Custom networks: how they are found, the messages for wrong ones, and that they train."""

import re
import sys
import textwrap

import numpy as np
import pytest
import torch
from run_contents import check_run, weights

import hierroom
from hierroom.agents.networks import make_network
from hierroom.learners.config import PPOConfig
from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.torch_backend import TorchBackend
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.train import main as train
from hierroom.worlds.env_config import EnvConfig

SPACE = AgentSpace((5, 3), 4)
SMALL = TrainConfig(EnvConfig("a", size=11, max_steps=60), num_envs=8, steps=512)
FLAGS = ["--graph", "a", "--size", "11", "--max-steps", "60", "--num-envs", "8"]
FLAGS += ["--steps", "512", "--minibatches", "2", "--evaluations", "2", "--evaluation-episodes", "8"]

MINE = """
    import torch
    from torch import nn

    class Mine(nn.Module):
        def __init__(self, space, hidden_size):
            super().__init__()
            self.heads = nn.Linear(space.n_features, space.n_actions + 1)

        def initial_state(self, n):
            return torch.zeros(n, 1)

        def step(self, features, state):
            outputs = self.heads(features.to(self.heads.weight.dtype))
            return outputs[..., :-1], outputs[..., -1], state

        def sequence(self, features, state, resets):
            return self.step(features, state)[:2]

    class Flat(Mine):
        def sequence(self, features, state, resets):
            return super().sequence(features.flatten(0, 1), state, resets)

    class Double(Mine):
        def step(self, features, state):
            logits, values, state = super().step(features, state)
            return logits.double(), values, state

    class Tied(Mine):
        def __init__(self, space, hidden_size):
            super().__init__(space, hidden_size)
            self.same = self.heads

    class Averaging(Mine):
        def __init__(self, space, hidden_size):
            super().__init__(space, hidden_size)
            self.register_buffer("mean", torch.zeros(space.n_features))
            self.always_still = nn.Identity().eval()

        def step(self, features, state):
            if self.training and features.ndim == 2:
                self.mean += 0.1 * (features.float().mean(0) - self.mean)
            return super().step(features, state)

    class Fragile(Mine):
        def step(self, features, state):
            raise RuntimeError("out of\\ncheese")

    class Detached(Mine):
        def sequence(self, features, state, resets):
            logits, values = super().sequence(features, state, resets)
            return logits, values.detach()

    class Frozen(Mine):
        def __init__(self, space, hidden_size):
            super().__init__(space, hidden_size)
            self.requires_grad_(False)

    class Stateless(Mine):
        def initial_state(self, n):
            return torch.zeros(1, 1)

    class Counting(Mine):
        # It forgets, in a sequence, that an episode ends.

        def step(self, features, state):
            logits, values, state = super().step(features, state)
            return logits, values + state[..., 0], state + 1

        def sequence(self, features, state, resets):
            logits, values, _ = super().step(features, state)
            return logits, values + state[:, 0] + torch.arange(len(features)).unsqueeze(1)

    class Random(Mine):
        # It draws, counts and learns rows.

        def __init__(self, space, hidden_size):
            super().__init__(space, hidden_size)
            self.rows = nn.Embedding(max(space.cardinalities), 1)
            self.dropout = nn.Dropout(0.5)
            self.register_buffer("n_turns", torch.zeros(()))

        def step(self, features, state):
            self.n_turns += 1
            return super().step(self.dropout(self.rows(features.int())[..., 0]), state)

    class Writing(Counting):
        # It writes to what it is given.

        def step(self, features, state):
            logits, values, _ = Mine.step(self, features, state)
            values = values + state[..., 0]
            features.zero_()
            return logits, values, state.add_(1)

        def sequence(self, features, state, resets):
            outputs = []
            for turn, reset in zip(features, resets):
                state = torch.where(reset[:, None], self.initial_state(len(turn)), state)
                logits, values, state = self.step(turn.clone(), state.clone())
                outputs.append((logits, values))
            return tuple(map(torch.stack, zip(*outputs)))

    class Endless(Mine):
        def step(self, features, state):
            logits, values, state = super().step(features, state)
            return logits / 0, values, state

    class Naming(Mine):
        def get_extra_state(self):
            return {"a": 1}

    class Sizeless(Mine):
        def __init__(self, space):
            super().__init__(space, 1)

    class NoModule:
        initial_state, step, sequence = Mine.initial_state, Mine.step, Mine.sequence
        def __init__(self, space, hidden_size):
            pass
"""


@pytest.fixture
def outside(tmp_path, monkeypatch):
    """The name of a module in a folder outside the package; another one for each test, as Python remembers them."""
    name = re.sub(r"\W", "_", f"networks_{tmp_path.name}")
    (tmp_path / f"{name}.py").write_text(textwrap.dedent(MINE))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", [*sys.path])  # finding a module may add to it
    return name


def test_a_class_in_the_current_folder_trains_from_the_command_line(outside, tmp_path):
    arguments = [*FLAGS, "--network", f"{outside}:Mine", "--out", str(tmp_path / "run")]
    assert train(arguments) == 0
    assert check_run(tmp_path / "run")["steps"] == 512
    learned = weights(RunFolder.open(tmp_path / "run").load_checkpoint())
    assert {name: len(values) for name, values in learned.items()} == {"heads.weight": 6, "heads.bias": 6}


def test_tied_weights_are_saved_and_loaded(outside, tmp_path):
    entries = {"num_envs": 8, "steps": 512, "minibatches": 2, "evaluations": 0, "log": "none", "film": False}
    agent = hierroom.train(graph="a", size=11, max_steps=60, network=f"{outside}:Tied", out=tmp_path / "run", **entries)
    agent.save(tmp_path / "agent.safetensors")
    again = hierroom.load(tmp_path / "agent.safetensors", trust=True)
    played = [[episode.actions.tolist() for episode in hierroom.rollout(one, episodes=2)] for one in (agent, again)]
    assert played[0] == played[1]


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("best", "a network is one of recurrent or package.module:Class"),
        ("nowhere:Mine", "there is no module 'nowhere' for the network 'nowhere:Mine'"),
        ("{outside}:Yours", "{it} cannot be loaded: AttributeError: module"),
        ("{outside}:Sizeless", "{it} cannot be made: TypeError: "),
        ("{outside}:NoModule", "{it} must be a torch.nn.Module with initial_state, step"),
        ("{outside}:Fragile", "{it}, in its first turns, fails: RuntimeError: out of cheese"),
        ("{outside}:Double", "{it} gives logits of step of torch.float64, not torch.float32"),
        ("{outside}:Detached", "{it} gives values of sequence without a gradient: no weight"),
        ("{outside}:Naming", "{it} has a state_dict whose _extra_state is no tensor; runs save only tensors"),
        ("{outside}:Frozen", "{it} has no weights to learn: no parameter requires a gradient"),
        ("{outside}:Stateless", "{it} gives 2 environments an initial state of shape (1, 1)"),
        ("{outside}:Counting", "{it} gives other values in sequence than in step, by up to 2;"),
        (None, "a network is named, like recurrent or package.module:Class, not None"),
        ("{outside}:Endless", "{it} gives logits of step that are not finite: "),
        ("{outside}:Flat", "{it} gives logits of sequence of shape (6, 4), not (3, 2, 4)"),
    ],
)
def test_an_invalid_spec_raises_input_error(outside, spec, said):
    spec = spec and spec.format(outside=outside)
    said = said.format(outside=outside, it=f"the network '{spec}'")
    with pytest.raises(InputError, match=f"^{re.escape(said)}") as caught:
        make_network(spec, SPACE, 8, None)
    assert "\n" not in str(caught.value)


def test_network_trial_has_no_side_effects(outside):
    torch.manual_seed(3)
    tried = make_network(f"{outside}:Random", SPACE, 8, None)
    after = torch.rand(1)
    torch.manual_seed(3)
    fresh = sys.modules[outside].Random(SPACE, 8)
    assert after == torch.rand(1)
    assert tried.n_turns == 0
    assert all(torch.equal(one, other) for one, other in zip(tried.parameters(), fresh.parameters(), strict=True))
    assert all(parameter.grad is None for parameter in tried.parameters())
    assert all(module.training for module in tried.modules())


def test_a_network_may_overwrite_its_inputs(outside):
    """The learner keeps the state before a turn, and its features, for the update."""
    network = make_network(f"{outside}:Writing", SPACE, 8, None)
    backend = TorchBackend(network, PPOConfig(), "cpu", SPACE)
    features, states = np.ones((2, SPACE.n_features), np.uint8), backend.initial_states(2)
    _, _, after = backend.step(features, states)
    assert (after == states + 1).all()
    assert (states == 0).all()
    assert features.all()


def test_evaluations_do_not_change_running_statistics(outside):
    trained = []
    for evaluations in (0, 2):
        trainer = Trainer(SMALL.changed(network=f"{outside}:Averaging", minibatches=2))
        for _ in range(2):
            trainer.advance()
            for _ in range(evaluations):
                trainer.evaluate()
        network = trainer.controller.learner.network
        assert network.heads.training
        assert not network.always_still.training
        trained.append(network.state_dict())
    assert trained[0]["mean"].any()
    for name, values in trained[0].items():
        assert torch.equal(values, trained[1][name]), name


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda logits, values, state: (logits[:, 1:], values, state),
            "of shapes (2, 3), (2,), (2, 1), not (2, 4)",
        ),
        (
            lambda logits, values, state: (logits, values[:, None], state),
            "of shapes (2, 4), (2, 1), (2, 1), not",
        ),
        (lambda logits, values, state: (logits, values, state[:1]), "of shapes (2, 4), (2,), (1, 1), not (2, 4), (2,)"),
        (lambda logits, values, state: (logits, values), "fails: ValueError: not enough values to unpack"),
    ],
)
def test_other_outputs_after_the_trial_raise_input_error(outside, change, said):
    """Compiled code does not check array bounds, so that one logit too many would be read from anywhere."""
    network = make_network(f"{outside}:Mine", SPACE, 8, None)
    backend = TorchBackend(network, PPOConfig(), "cpu", SPACE)
    step, given = network.step, (np.ones((2, SPACE.n_features), np.uint8), backend.initial_states(2))
    backend.step(*given)
    network.step = lambda *inputs: change(*step(*inputs))
    with pytest.raises(InputError, match=f"^the network Mine .*{re.escape(said)}"):
        backend.step(*given)
