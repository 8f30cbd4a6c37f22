"""Sampling from masked logits: against shares by hand and torch's softmax."""

import numpy as np
import pytest
import torch

from hierroom.learners.sampling import greedy_actions, log_probabilities, sample_actions

SHARES = np.array([0.5, 0.125, 0.25, 0.125])


def softmax_of(logits, masks):
    return torch.from_numpy(np.where(masks, logits, -np.inf)).log_softmax(-1).numpy()


@pytest.mark.parametrize(
    ("mask", "edges"),
    [
        ([True] * 4, [0.5, 0.625, 0.875, 1]),
        ([False, True, True, True], [0, 0.25, 0.75, 1]),
        ([True, False, True, False], [2 / 3, 2 / 3, 1, 1]),
        ([False, True, False, False], [0, 1, 1, 1]),
    ],
)
@pytest.mark.parametrize("shift", [0, -1000, 1000])
def test_each_legal_action_has_its_share_of_the_uniforms(mask, edges, shift):
    uniforms = (np.arange(1000) + 0.5) / 1000
    logits = np.tile(np.where(mask, np.log(SHARES) + shift, 1e6), (1000, 1))  # an illegal one must not count
    actions, _ = sample_actions(logits, np.tile(mask, (1000, 1)), uniforms)
    np.testing.assert_array_equal(actions, np.searchsorted(edges, uniforms))


def test_uniform_on_a_boundary_takes_the_next_action():
    actions, _ = sample_actions(np.zeros((4, 4)), np.ones((4, 4), bool), np.arange(4) / 4)
    np.testing.assert_array_equal(actions, np.arange(4))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_log_probabilities_equal_those_of_log_softmax(dtype):
    random = np.random.default_rng(0)
    logits, masks = (5 * random.normal(size=(500, 6))).astype(dtype), random.random((500, 6)) < 0.5
    masks[np.arange(500), random.integers(6, size=500)] = True
    actions, log_probs = sample_actions(logits, masks, random.random(500))
    rows, expected = np.arange(500), softmax_of(logits, masks)
    assert masks[rows, actions].all()
    assert log_probs.dtype == dtype
    np.testing.assert_allclose(log_probs, expected[rows, actions], rtol=1e-5, atol=1e-5)
    for action in range(6):
        found = log_probabilities(logits, masks, np.full(500, action))
        np.testing.assert_allclose(found, expected[:, action], rtol=1e-5, atol=1e-5)


def test_rounding_remainder_goes_to_the_last_legal_action():
    logits, masks = np.log(np.full((1, 10), 0.1, np.float32)), np.ones((1, 10), bool)
    masks[0, 8:] = False
    assert sample_actions(logits, masks, np.array([np.nextafter(1, 0)]))[0] == 7


def test_greedy_actions_take_the_first_of_equals():
    logits = np.array([[3, 1, 2, 2], [1, 1, 1, 1], [-5, -7, -6, -9]])
    masks = np.array([[False, True, True, True], [True] * 4, [False, True, False, True]])
    np.testing.assert_array_equal(greedy_actions(logits, masks), [2, 0, 1])
