"""A task whose numbers have other scales is learned, and its scales are saved and used."""

import sys
from types import ModuleType

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium import spaces

import hierroom
from hierroom.runs.folder.weights import SavedAgent
from hierroom.support.errors import InputError, warn_once

TRAINED = {"method": "ppo", "evaluations": 0, "film": False, "log": "none", "quiet": True, "threads": 1}


class Cue(gymnasium.Env):
    """An episode of one step: the action must name the cue, which is 0 or 1."""

    action_space = spaces.Discrete(2)

    def __init__(self, bound, size=1.0):
        self.size = size
        self.observation_space = spaces.Box(np.array([0, -bound], np.float32), np.array([1, bound], np.float32))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.cue = int(self.np_random.integers(2))
        other = self.np_random.uniform(-self.size, self.size)
        return np.array([self.cue, other], np.float32), {}

    def step(self, action):
        reward = float(action == self.cue)
        return self.reset()[0], reward, True, False, {}


class Frames(Cue):
    """The cue as a frame of 84 x 84 x 3."""

    def __init__(self):
        self.observation_space = spaces.Box(0, 255, (84, 84, 3), np.uint8)
        self.size = 1.0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return np.full((84, 84, 3), 200 * self.cue, np.uint8), {}


@pytest.fixture(autouse=True)
def tasks(monkeypatch):
    module = ModuleType("cues")
    makes = {
        "near": lambda: Cue(1.0),
        "far": lambda: Cue(100.0, 100.0),
        "endless": lambda: Cue(np.inf, 100.0),
        "beyond": lambda: Cue(1.0, 3.0),
        "frames": Frames,
    }
    for name, make in makes.items():
        setattr(module, name, hierroom.Task(make))
    monkeypatch.setitem(sys.modules, "cues", module)


def agrees(agent):
    """The network gives the logits and values of `act`."""
    env = hierroom.add_features(gymnasium.make_vec("hierroom/Task-v0", 3, **vars(agent.env())), agent)
    observations, state = env.reset(seed=1)[0], None
    for _ in range(3):
        actions, state = agent.act(observations, state, begins=np.ones(3, bool))
        features = torch.from_numpy(observations["features"].astype(np.uint8))
        logits, values, _ = (one.detach().numpy() for one in agent.network(features, agent.network.initial_state(3)))
        np.testing.assert_allclose(logits, state.decision.logits, atol=2e-5)
        np.testing.assert_allclose(values, state.decision.values, atol=2e-5)
        observations = env.step(actions)[0]


@pytest.mark.slow
@pytest.mark.parametrize("task", ["near", "far", "endless"])
def test_cue_is_learned_whatever_the_other_bounds(task, tmp_path):
    agent = hierroom.train(task=f"cues:{task}", steps=4096, out=tmp_path / "run", **TRAINED)
    assert np.mean([one.extrinsic.sum() for one in hierroom.rollout(agent, episodes=100, seed=1)]) >= 0.95
    agent.save(tmp_path / "agent.safetensors")
    again = hierroom.load(tmp_path / "agent.safetensors", trust=True)
    for name, weight in agent.controller.learner.network.state_dict().items():
        assert torch.equal(weight, again.controller.learner.network.state_dict()[name]), name
    agrees(again)


@pytest.mark.slow
@pytest.mark.parametrize("pictures", ["nature", "impala"])
def test_frames_train(pictures, tmp_path):
    sizes = {"num_envs": 4, "sequence_length": 8, "minibatches": 2, "epochs": 1, "pictures": pictures}
    agent = hierroom.train(task="cues:frames", steps=96, out=tmp_path / "run", **TRAINED, **sizes)
    agrees(agent)


def test_saved_agent_without_its_scales_is_refused_in_one_line(tmp_path):
    sizes = {"num_envs": 4, "sequence_length": 8, "minibatches": 2, "epochs": 1, "hidden_size": 8}
    warn_once.cache_clear()
    with pytest.warns(UserWarning, match=r"^the observations of cues:beyond leave the bounds of 'observation', with "):
        agent = hierroom.train(task="cues:beyond", steps=64, out=tmp_path / "run", **TRAINED, **sizes)
    own = {**agent.controller.weights}
    network = own["learner"]["backend"]["network"]
    for name in [name for name in network if "scale" in name]:
        del network[name]
    SavedAgent(agent.config, 64, {"controller_0": own}).write(tmp_path / "agent.safetensors")
    with pytest.raises(InputError, match=r"^\S+ does not fit its config: .* lacks 'encoder.scale.factor'[^\n]*$"):
        hierroom.load(tmp_path / "agent.safetensors", trust=True)
