"""Distributions of actions equal torch's own, and their samples have their probabilities."""

import numpy as np
import torch
from hypothesis import given
from hypothesis import strategies as st

from hierroom.learners.distributions import Gaussian, MultiCategorical

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
