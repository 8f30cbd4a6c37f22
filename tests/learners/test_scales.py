"""Scales of observations and rewards, and the published networks of pictures."""

from copy import deepcopy

import numpy as np
import pytest
import torch
from learner_envs import RandomEnvs, make_learner
from same_state import equal

from hierroom.agents.networks import make_network
from hierroom.learners.config import PPOConfig
from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.networks.pictures import PictureEncoder
from hierroom.learners.networks.scale import RunningScale
from hierroom.learners.ppo import Learner
from hierroom.support.byte_array import ByteArray

FRAME = ByteArray((84, 84, 3), "pixels", 0, 255)


@pytest.mark.parametrize(
    ("name", "n_convolutions", "size", "n_weights"),
    [
        # Mnih et al. 2015: 8 x 8 x 32, 4 x 4 x 64, 3 x 3 x 64, then 7 * 7 * 64 to 512.
        ("nature", 3, 512, 3 * 64 * 32 + 32 + 32 * 16 * 64 + 64 + 64 * 9 * 64 + 64 + 3136 * 512 + 512),
        # Espeholt et al. 2018, figure 3: 15 convolutions of 3 x 3, then 11 * 11 * 32 to 256.
        ("impala", 15, 256, 448 + 4 * 2320 + 4640 + 4 * 9248 + 9248 + 4 * 9248 + 3872 * 256 + 256),
    ],
)
def test_networks_of_pictures_have_their_published_sizes(name, n_convolutions, size, n_weights):
    network = PictureEncoder(FRAME, size, name)
    assert sum(isinstance(one, torch.nn.Conv2d) for one in network.modules()) == n_convolutions
    assert sum(weight.numel() for weight in network.parameters()) == n_weights
    frames = torch.randint(0, 256, (2, 84 * 84 * 3), dtype=torch.uint8)
    assert network(frames).shape == (2, size)
    inside = make_network(
        "recurrent",
        AgentSpace((256,) * FRAME.n_bytes, 2, ((0, FRAME),)),
        64,
        None,
        PPOConfig(memory="none", pictures=name),
    )
    assert sum(weight.numel() for weight in inside.encoder.pictures.parameters()) == n_weights


def test_one_infinite_bound_changes_no_other_entry():
    numbers = np.random.default_rng(0).normal(size=(50, 3)) * [0.1, 1, 200]
    scaled = []
    for bound in (1000.0, np.inf):
        scale = RunningScale(np.array([-1, -5, -bound]), np.array([1, 5, bound]))
        scale.learn(numbers)
        scaled.append(scale.scaled(numbers.astype(np.float32)))
    np.testing.assert_array_equal(scaled[0][:, :2], scaled[1][:, :2])
    np.testing.assert_allclose(scaled[0][:, 0], numbers[:, 0], rtol=1e-5)
    assert scaled[1][:, 2].mean() == pytest.approx(0, abs=1e-5)
    assert scaled[1][:, 2].std() == pytest.approx(1, rel=1e-4)


class PaidEnvs(RandomEnvs):
    """Random environments whose rewards are multiplied."""

    factor = 1.0

    def finish(self, learner, envs):
        finish = learner.finish
        learner.finish = lambda envs, rewards, *rest: finish(envs, self.factor * rewards, *rest)
        try:
            return super().finish(learner, envs)
        finally:
            del learner.finish


def play(learner, envs, n_updates):
    while n_updates:
        n_updates -= envs.tick(learner)[3] is not None


def test_the_unit_of_rewards_changes_nothing():
    weights, values = [], []
    for factor in (0.01, 1, 100):
        learner, envs = make_learner(scale_returns=True), PaidEnvs(6, seed=2)
        envs.factor = factor
        play(learner, envs, 8)
        weights.append(torch.cat([weight.detach().ravel() for weight in learner.network.parameters()]))
        policy = learner.policy(6, seed=0)
        policy.act(np.arange(6), envs.features, np.ones((6, 4), bool))
        values.append(policy.decision.values / factor)
    for other in (0, 2):
        torch.testing.assert_close(weights[other], weights[1], atol=2e-3, rtol=1e-2)
        np.testing.assert_allclose(values[other], values[1], atol=2e-2)
    start = torch.cat([weight.detach().ravel() for weight in make_learner().network.parameters()])
    assert (weights[1] - weights[0]).abs().max() < 0.1 * (weights[1] - start).abs().max()


@pytest.mark.parametrize("memory", ["none", "lstm"])
def test_learner_with_scales_resumes_exactly_within_a_rollout(memory):
    array = ByteArray((2,), "numbers", bounds=((-1, -np.inf), (1, np.inf)))
    space = AgentSpace((5, *(256,) * array.n_bytes), 4, ((1, array),))

    class Numbered(RandomEnvs):
        def draw_features(self, n):
            numbers = array.to_bytes(self.random.normal(size=(n, 2)) * [1, 200])
            return np.concatenate([self.random.integers(0, 5, (n, 1)).astype(np.uint8), numbers], axis=1)

    config = PPOConfig(
        sequence_length=5, minibatches=2, hidden_size=8, memory=memory, scale_observations=True, scale_returns=True
    )

    def make():
        return Learner(space, 6, config, seed=1, network=lambda *sizes: make_network("recurrent", *sizes, None, config))

    whole, envs = make(), Numbered(6, 3, space)
    play(whole, envs, 2)
    envs.tick(whole)
    resumed, state, other = make(), deepcopy(whole.state_dict()), deepcopy(envs)
    resumed.load_state_dict(state)
    play(whole, envs, 2)
    play(resumed, other, 2)
    assert equal(whole.state_dict(), resumed.state_dict())
