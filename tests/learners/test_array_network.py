"""Networks for arrays as bytes among the categories, made, learning, compiled as in torch, and for array actions."""

from functools import partial

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from learner_envs import RandomEnvs

from hierroom.agents.networks import make_network, try_network
from hierroom.learners.config import PPOConfig
from hierroom.learners.distributions import Gaussian, MultiCategorical
from hierroom.learners.fused.backend import FusedBackend
from hierroom.learners.networks.actor_critic import AgentSpace, RecurrentActorCritic
from hierroom.learners.networks.array_network import ArrayActorCritic
from hierroom.learners.ppo import Learner
from hierroom.learners.torch_backend import TorchBackend
from hierroom.support.byte_array import ByteArray

ARRAYS = {
    "pixels": ByteArray((84, 84, 3), "pixels", 0, 255),
    "small pixels": ByteArray((20, 32, 1), "pixels", 0, 255),
    "float pixels": ByteArray((40, 40, 2), "pixels", -1, 1),
    "symbols": ByteArray((7, 7, 3), "symbols", 0, 255),
    "a single cell": ByteArray((1, 2, 1), "symbols", 0, 255),
    "bounded numbers": ByteArray((4,), "numbers", -2.0, 2.0),
    "numbers": ByteArray((2, 3), "numbers"),
    "ids": ByteArray((2,), "ids", n_values=500),
}


def space_of(*arrays):
    """A category of 5, each array, and a category of 3."""
    places, start = [], 1
    for array in arrays:
        places.append((start, array))
        start += array.n_bytes
    return AgentSpace((5, *(256,) * (start - 1), 3), 4, tuple(places))


@pytest.mark.parametrize("usual", [torch.float32, torch.float64])
@pytest.mark.parametrize("name", ARRAYS)
def test_each_array_kind_gets_a_trainable_network(name, usual):
    space = space_of(ARRAYS[name])
    torch.set_default_dtype(usual)
    try:
        network = make_network("recurrent", space, 16, None)
        assert type(network) is ArrayActorCritic
        try_network(name, network, space)
    finally:
        torch.set_default_dtype(torch.float32)
    assert {weights.dtype for weights in network.parameters()} == {torch.float32}


def test_categories_alone_use_the_compiled_network():
    assert type(make_network("recurrent", AgentSpace((5, 3), 4), 16, None)) is RecurrentActorCritic


def test_encoder_reads_numbers_and_ids_from_bytes():
    space = space_of(ARRAYS["bounded numbers"], ARRAYS["ids"])
    numbers = np.array([[0.5, -2.0, 2.0, 0.0]] * 2, np.float32)
    ids = np.array([[3, 499], [0, 7]])
    rows = [ARRAYS["bounded numbers"].to_bytes(numbers), ARRAYS["ids"].to_bytes(ids)]
    features = torch.from_numpy(np.concatenate([[[4], [1]], *rows, [[2], [0]]], axis=1).astype(np.uint8))
    encoder = ArrayActorCritic(space, 8).encoder
    scaled = torch.tensor([[0.25, -1.0, 1.0, 0.0]] * 2)
    table = encoder.arrays[1].table.weight
    expected = (
        encoder.categories.linear(features[:, [0, -1]])
        + encoder.arrays[0].layers(scaled)
        + table[ids[:, 0]]
        + table[500 + ids[:, 1]]
    )
    torch.testing.assert_close(encoder(features), torch.relu(expected))


def test_learner_learns_the_sign_of_a_number():
    """The right action is the sign of a number; without reading it no policy is right in more than half the turns."""
    array, rng = ByteArray((1,), "numbers", -1, 1), np.random.default_rng(0)
    space = AgentSpace((256,) * 4, 2, ((0, array),))
    config = PPOConfig(sequence_length=2, epochs=2, minibatches=2, learning_rate=1e-2, hidden_size=16)
    learner = Learner(space, 32, config, seed=0, network=lambda *sizes: make_network("recurrent", *sizes, None))
    envs, no, yes = np.arange(32), np.zeros(32, bool), np.ones(32, bool)
    for _ in range(20):
        right = []
        while not learner.ready:
            numbers = rng.choice([-1.0, 1.0], (32, 1))
            actions = learner.act(envs, array.to_bytes(numbers), np.ones((32, 2), bool))
            is_right = actions == (numbers[:, 0] > 0)
            learner.finish(envs, is_right.astype(float), np.ones(32, int), yes, no, yes)
            right.append(is_right.mean())
        learner.update(0.0)
    assert np.mean(right) > 0.9


KINDS = (
    ByteArray((3,), "numbers", bounds=((-1, -5, -np.inf), (1, 5, np.inf))),
    ByteArray((2, 2, 1), "symbols", 0, 255),
    ByteArray((1,), "ids", n_values=500),
)


class ArrayEnvs(RandomEnvs):
    """Random environments that show two categories, numbers of three scales, symbols and an id."""

    def draw_features(self, n):
        values = self.random.normal(size=(n + 1, 3)) * [1, 3, 200], self.random.integers(0, 9, (n + 1, 4))
        values += (self.random.integers(0, 500, (n + 1, 1)),)
        parts = [array.to_bytes(value) for array, value in zip(KINDS, values, strict=True)]
        return np.concatenate([self.random.integers(0, (3, 4), (n + 1, 2)).astype(np.uint8), *parts], axis=1)[:n]


@pytest.mark.parametrize("memory", ["none", "lstm"])
def test_compiled_and_torch_updates_agree_on_arrays(memory):
    starts = np.cumsum([2, *(array.n_bytes for array in KINDS)])
    space = AgentSpace((3, 4, *[256] * (starts[-1] - 2)), 4, tuple(zip(starts[:-1].tolist(), KINDS, strict=True)))
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


SIZES = st.lists(st.integers(1, 5), min_size=1, max_size=4).map(tuple)
SEEDS = st.integers(0, 2**32 - 1)


def parts(distribution, n_outputs, n, seed):
    """Return random outputs and masks, and actions with their log-probabilities as sampled."""
    random = np.random.default_rng(seed)
    outputs, masks = 2 * random.standard_normal((n, n_outputs)).astype(np.float32), np.zeros((n, 0), bool)
    return outputs, masks, *distribution.sample(outputs, masks, distribution.noise(random, n))


@given(SIZES, SEEDS)
def test_several_numbers_are_independent_categoricals(sizes, seed):
    distribution = MultiCategorical(sizes)
    outputs, masks, actions, sampled = parts(distribution, sum(sizes), 7, seed)
    tensors = torch.from_numpy(outputs), torch.from_numpy(masks), torch.from_numpy(actions)
    own = [torch.distributions.Categorical(logits=part) for part in tensors[0].split(sizes, dim=1)]
    log_probs = sum(one.log_prob(tensors[2][:, k]) for k, one in enumerate(own))
    found, entropies = distribution.evaluate(*(tensor[None] for tensor in tensors))
    for one in (sampled, distribution.log_probs(outputs, masks, actions), found[0]):
        np.testing.assert_allclose(one, log_probs, atol=1e-5)
    np.testing.assert_allclose(entropies[0], sum(one.entropy() for one in own), atol=1e-5)
    probabilities = torch.cat([one.probs for one in own], dim=1)
    np.testing.assert_allclose(distribution.probabilities(outputs, masks), probabilities, atol=1e-6)
    greedy = [part.argmax(1) for part in tensors[0].split(sizes, dim=1)]
    np.testing.assert_array_equal(distribution.greedy(outputs, masks), np.stack(greedy, axis=1))


@given(st.integers(1, 4), SEEDS)
def test_real_numbers_are_independent_normals(n_numbers, seed):
    distribution = Gaussian((2,) * n_numbers)
    outputs, masks, actions, sampled = parts(distribution, 2 * n_numbers, 7, seed)
    tensors = torch.from_numpy(outputs), torch.from_numpy(masks), torch.from_numpy(actions)
    means, log_deviations = tensors[0].chunk(2, dim=1)
    own = torch.distributions.Normal(means, log_deviations.exp())
    found, entropies = distribution.evaluate(*(tensor[None] for tensor in tensors))
    for one in (sampled, distribution.log_probs(outputs, masks, actions), found[0]):
        np.testing.assert_allclose(one, own.log_prob(tensors[2]).sum(1), rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(entropies[0], own.entropy().sum(1), rtol=1e-4, atol=1e-4)
    np.testing.assert_array_equal(distribution.greedy(outputs, masks), means)


def test_samples_have_the_probabilities_of_the_outputs():
    n, outputs = 20_000, np.log(np.array([[0.2, 0.8, 0.5, 0.4, 0.1]], np.float32))
    distribution, random = MultiCategorical((2, 3)), np.random.default_rng(0)
    actions, _ = distribution.sample(np.repeat(outputs, n, 0), np.zeros((n, 0), bool), distribution.noise(random, n))
    shares = [(actions[:, k] == value).mean() for k, value in ((0, 1), (1, 0), (1, 2))]
    np.testing.assert_allclose(shares, [0.8, 0.5, 0.1], atol=0.015)
    normal, outputs = Gaussian((2,)), np.array([[3.0, np.log(2)]], np.float32)
    actions, _ = normal.sample(np.repeat(outputs, n, 0), np.zeros((n, 0), bool), normal.noise(random, n))
    np.testing.assert_allclose([actions.mean(), actions.std()], [3, 2], atol=0.06)
