"""Tasks that are too large are refused in one line, before its memory is taken."""

import sys
from types import ModuleType

import numpy as np
import pytest
from chest_task import Chest
from gymnasium import spaces

import hierroom
from hierroom.agents.networks import make_network
from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.rollout import Rollout
from hierroom.support.errors import InputError
from hierroom.worlds.task.spaces import feature_of, read_entry


class Sized(Chest):
    """A chest that shows one number of a space."""

    def __init__(self, space):
        super().__init__()
        self.observation_space, self.shown = space, space.sample()

    def _observation(self):
        return self.shown


def task_of(space):
    return hierroom.Task(lambda: Sized(space), {"chest": lambda env, info: env.unwrapped.is_open}, target="chest")


@pytest.mark.parametrize(
    ("space", "hidden_size", "said"),
    [
        (
            spaces.Discrete(10**6),
            64,
            "discrete numbers with 1,000,000 values would need 256 MB of weights, and at most 1",
        ),
        (
            spaces.MultiDiscrete([2000, 9] * 150),
            64,
            "discrete numbers with 600,000 values would need 154 MB of weights",
        ),
        (spaces.MultiBinary(300_000), 64, "discrete numbers with 600,000 values would need 154 MB of weights"),
        (spaces.Box(-1, 1, (70_000,)), 512, "70,000 numbers would need 143 MB of weights"),
        (spaces.Box(0, 255, (300, 300), np.uint8), 512, "an image of shape (300, 300, 1) would need 152 MB of weights"),
        (spaces.Discrete(2), 4096, "a recurrent core of 4,096 units would need 537 MB of weights"),
        (spaces.Box(0, 255, (3000, 3000), np.uint8), 64, "a network reads up to 4,194,304 numbers of an entry"),
        (spaces.Discrete(10**10), 64, "a network reads discrete numbers of up to 2**31 values; number has 10,000"),
    ],
)
def test_network_of_a_large_observation_raises_input_error(space, hidden_size, said):
    with pytest.raises(InputError) as refused:
        network_of(space, hidden_size)
    assert str(refused.value).startswith(said)


def network_of(space, hidden_size=8, vectors=None):
    feature = feature_of("number", space)
    arrays = () if feature.array is None else ((0, feature.array),)
    return make_network("recurrent", AgentSpace(feature.cardinalities, 3, arrays), hidden_size, vectors)


def test_large_vectors_raise_input_error():
    with pytest.raises(InputError, match=r"vectors with 5,000,000 numbers would need 160 MB of weights"):
        network_of(spaces.Discrete(2), 8, [np.zeros((2, 5 * 10**6), np.int8)])
    vectors = [None] * 5000 + [np.eye(2)]
    with pytest.raises(InputError, match="vectors next to so many values would need 400 MB of weights"):
        make_network("recurrent", AgentSpace((2,) * 5001, 3), 8, vectors)


def test_many_turns_raise_input_error():
    said = "2,000 sequences of 1,000 turns with 600 bytes of features each need 1,276 MB, and at most 1,074 MB are "
    with pytest.raises(InputError, match=f"^{said}allowed: lower num_envs, sequence_length or sequences_per_update"):
        Rollout(1000, 1000, 2000, n_features=600, n_actions=3, state_size=128)


@pytest.mark.parametrize(
    "space", [spaces.Discrete(255, start=1, dtype=np.uint8), spaces.MultiDiscrete([255], np.uint8)]
)
def test_bytes_up_to_the_largest_are_inside(space):
    shown = [np.full(space.shape, number, np.uint8) for number in (int(np.min(space.start)), 254)]
    assert read_entry(shown, "number", (), space, "a task").ravel().tolist() == [int(one.max()) for one in shown]


def test_environments_of_a_large_discrete_number_play():
    task = task_of(spaces.Discrete(10**10))
    env = hierroom.env(task)
    env.reset(seed=0)
    assert env.observe("controller_0")["observation"] < 10**10


def test_training_with_a_large_discrete_number_makes_no_folder(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "large", module := ModuleType("large"))
    module.task = task_of(spaces.Discrete(10**6))
    with pytest.raises(InputError, match="would need 512 MB of weights"):
        hierroom.train(task="large:task", steps=64, num_envs=4, out=tmp_path / "run", quiet=True)
    assert not (tmp_path / "run").exists()


def test_many_goals_raise_input_error():
    with pytest.raises(InputError, match="a world has at most 63 goals, not 100000"):
        hierroom.Task(Chest, {str(n): lambda env, info: False for n in range(10**5)}, target="0")
