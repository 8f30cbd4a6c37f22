"""Advantages against numbers worked by hand."""

import numpy as np
import pytest

from hierroom.learners.gae import generalized_advantages


def advantages(rewards, values, next_values, *, elapsed=None, terminated=(), truncated=(), gamma, gae_lambda):
    n = len(rewards)
    ends = np.zeros((2, n, 1), bool)
    ends[0, list(terminated)] = True
    ends[1, list(truncated)] = True
    column = lambda x: np.asarray(x, np.float64)[:, None]  # noqa: E731
    columns, steps = map(column, (rewards, values, next_values)), np.asarray(elapsed or [1] * n)[:, None]
    return generalized_advantages(*columns, steps, *ends, gamma=gamma, gae_lambda=gae_lambda)[:, 0]


@pytest.mark.parametrize(
    ("rewards", "values", "next_values", "others", "expected"),
    [
        # deltas: 1 + .5*4 - 2 = 1; 0 + .5*6 - 4 = -1; 2 + .5*8 - 6 = 0. A2 = 0; A1 = -1 + .25*0; A0 = 1 + .25*-1.
        pytest.param([1, 0, 2], [2, 4, 6], [4, 6, 8], {"gae_lambda": 0.5}, [0.75, -1, 0], id="three plain turns"),
        pytest.param([1], [2], [4], {"gae_lambda": 0.5}, [1], id="one turn"),  # 1 + .5*4 - 2
        # gamma^3 = .125. deltas: 1 + .125*8 - 1 = 1; 3 + .5*2 - 8 = -4. A1 = -4; A0 = 1 + .125*1*-4.
        pytest.param([1, 3], [1, 8], [8, 2], {"elapsed": [3, 1], "gae_lambda": 1.0}, [0.5, -4], id="three steps"),
        # The next value 100 is not read. deltas: 1 - 2 = -1; 0 + .5*2 - 4 = -3.
        pytest.param([1, 0], [2, 4], [100, 2], {"terminated": [0], "gae_lambda": 0.9}, [-1, -3], id="terminated"),
        # deltas: 1 + .5*10 - 2 = 4; 0 + .5*2 - 4 = -3; the -3 stays out of the first.
        pytest.param([1, 0], [2, 4], [10, 2], {"truncated": [0], "gae_lambda": 0.9}, [4, -3], id="truncated"),
    ],
)
def test_advantages_worked_by_hand(rewards, values, next_values, others, expected):
    np.testing.assert_allclose(advantages(rewards, values, next_values, gamma=0.5, **others), expected)


@pytest.mark.parametrize("cut", ["terminated", "truncated"])
def test_sequences_do_not_mix(cut):
    random = np.random.default_rng(0)
    rewards, values, next_values = random.normal(size=(3, 6, 4))
    elapsed = random.integers(1, 5, (6, 4))
    none, some = np.zeros((6, 4), bool), random.random((6, 4)) < 0.3
    ends = {"terminated": none, "truncated": none} | {cut: some}
    together = generalized_advantages(rewards, values, next_values, elapsed, **ends, gamma=0.9, gae_lambda=0.8)
    for m in range(4):
        one = {name: flags[:, [m]] for name, flags in ends.items()}
        alone = generalized_advantages(
            rewards[:, [m]], values[:, [m]], next_values[:, [m]], elapsed[:, [m]], **one, gamma=0.9, gae_lambda=0.8
        )
        np.testing.assert_array_equal(together[:, [m]], alone)


def test_lambda_one_is_the_discounted_return_minus_the_value():
    rewards, values, elapsed = [1.0, 2.0, 3.0], [0.3, 0.2, 0.1], [2, 3, 1]
    found = advantages(rewards, values, [0.2, 0.1, 0.0], elapsed=elapsed, terminated=[2], gamma=0.9, gae_lambda=1)
    returns = [1 + 0.9**2 * (2 + 0.9**3 * 3), 2 + 0.9**3 * 3, 3]
    np.testing.assert_allclose(found, np.subtract(returns, values))
