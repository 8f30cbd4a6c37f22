"""Compiled networks of observations with arrays against torch."""

from functools import partial

import numpy as np
import pytest
from learner_envs import RandomEnvs

from hierroom.agents.networks import make_network
from hierroom.learners.config import PPOConfig
from hierroom.learners.fused.backend import FusedBackend
from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.ppo import Learner
from hierroom.learners.torch_backend import TorchBackend
from hierroom.support.byte_array import ByteArray

ARRAYS = (
    ByteArray((3,), "numbers", bounds=((-1, -5, -np.inf), (1, 5, np.inf))),
    ByteArray((2, 2, 1), "symbols", 0, 255),
    ByteArray((1,), "ids", n_values=500),
)


class ArrayEnvs(RandomEnvs):
    """Random environments that show two categories, numbers of three scales, symbols and an id."""

    def draw_features(self, n):
        values = self.random.normal(size=(n + 1, 3)) * [1, 3, 200], self.random.integers(0, 9, (n + 1, 4))
        values += (self.random.integers(0, 500, (n + 1, 1)),)
        parts = [array.to_bytes(value) for array, value in zip(ARRAYS, values, strict=True)]
        return np.concatenate([self.random.integers(0, (3, 4), (n + 1, 2)).astype(np.uint8), *parts], axis=1)[:n]


@pytest.mark.parametrize("memory", ["none", "lstm"])
def test_compiled_and_torch_updates_agree_on_arrays(memory):
    starts = np.cumsum([2, *(array.n_bytes for array in ARRAYS)])
    space = AgentSpace((3, 4, *[256] * (starts[-1] - 2)), 4, tuple(zip(starts[:-1].tolist(), ARRAYS, strict=True)))
    scales = {"memory": memory, "scale_observations": True, "scale_returns": True}
    config = PPOConfig(sequence_length=8, minibatches=3, epochs=2, hidden_size=16, **scales)
    make = partial(make_network, "recurrent", vectors=None, config=config)
    learners = [Learner(space, 6, config, seed=1, network=make) for _ in range(2)]
    assert isinstance(learners[0]._backend, FusedBackend)
    learners[1]._backend = TorchBackend(learners[1].network, config, "cpu", space)
    envs = [ArrayEnvs(6, seed=1, space=space) for _ in learners]
    for _ in range(3):
        turns = [env.tick(learner) for env, learner in zip(envs, learners, strict=True)]
        while not turns[0][3]:
            turns = [env.tick(learner) for env, learner in zip(envs, learners, strict=True)]
        assert turns[0][3] == pytest.approx(turns[1][3], rel=1e-3, abs=1e-5)
    compiled, plain = (learner.network.state_dict() for learner in learners)
    for name, weight in compiled.items():
        np.testing.assert_allclose(weight, plain[name], rtol=1e-3, atol=1e-3)
