"""The measures of deterministic MDPs, against numbers worked by hand, published ones and slow twins."""

import math

import gymnasium
import minigrid  # noqa: F401 - registers its environments
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from small_mdps import lock, play_gorp, random_mdp, slow_minimum_k

from benchmarks.measures.covering import covering_length
from benchmarks.measures.effective_horizon import effective_horizon, effective_planning_window, minimum_k, samples_of
from benchmarks.measures.gorp import Gorp
from benchmarks.measures.mdp import enumerate_env, graph_mdp
from hierroom.complexity import AugmentedGraph
from hierroom.goals import NAMED_GRAPHS


def minigrid_state(env):
    level = env.unwrapped
    held = None if level.carrying is None else level.carrying.encode()
    return tuple(map(int, level.agent_pos)), int(level.agent_dir), level.grid.encode().tobytes(), held


def test_values_of_a_lock():
    mdp = lock(3)
    assert mdp.is_binary
    assert mdp.shortest_solution() == 3
    np.testing.assert_allclose(mdp.random_values(3)[3][:3], [1 / 8, 1 / 4, 1 / 2])
    np.testing.assert_allclose(mdp.optimal_values(3)[:, 0], [0, 0, 0, 1])
    assert not mdp.worst_values(3).any()
    assert mdp.random_success(3) == pytest.approx(1 / 8)
    assert mdp.random_success(2) == 1  # the reward is out of reach, so that every policy is optimal


def test_effective_horizon_of_a_lock_by_hand():
    """k = 1: gap 1/4 and variance 1/4 at the first step, m = 16 * 4 ln 12; k = 2: 1/2 and 1/2, m = 16 * 2 ln 24."""
    found = effective_horizon(lock(3), 3)
    assert found.rollouts == {1: math.ceil(64 * math.log(12)), 2: math.ceil(32 * math.log(24))} == {1: 160, 2: 102}
    assert found.bounds[1] == pytest.approx(1 + math.log2(160))
    assert found.value == 3  # T: to look ahead to the end needs one rollout
    assert found.min_k == minimum_k(lock(3), 3) == 1
    assert samples_of(3, 2, found.value) == 9 * 8


@settings(max_examples=25)
@given(st.integers(0, 10_000), st.integers(1, 5))
def test_minimum_k_and_window_equal_their_definition(seed, horizon):
    mdp = random_mdp(seed)
    assert minimum_k(mdp, horizon) == slow_minimum_k(mdp, horizon)
    assert effective_planning_window(mdp, horizon) == slow_minimum_k(mdp, horizon, begin_with_rewards=True)


def test_measures_equal_published_numbers_of_a_minigrid_level():
    """MiniGrid-KeyCorridorS3R1-v0 in BRIDGE, as its authors' repository holds it (consolidated_analyzed.json)."""
    env = gymnasium.make("MiniGrid-KeyCorridorS3R1-v0")
    mdp = enumerate_env(env, minigrid_state, actions=range(6), reward=lambda earned: float(earned > 0))
    found = effective_horizon(mdp, 100)
    published = [6667295335345, 1392035355359, 278809136916, 54268730212, 10344878490, 3881656204, 719169930]
    published += [131899527, 23989567, 4332647, 1555678, 277857, 49406, 17501, 3089, 1]
    assert list(found.rollouts) == list(range(1, 17))
    np.testing.assert_allclose(list(found.rollouts.values()), published, rtol=1e-9)
    assert found.value == 16
    assert minimum_k(mdp, 100) == 1
    assert effective_planning_window(mdp, 100) == 15
    assert covering_length(mdp, 100).occupancy == pytest.approx(3.6251398378024507e-7, rel=1e-9)
    assert Gorp(mdp, 100).rollouts().effective_horizon < 4.068  # their upper bound on H_1


def test_gorp_on_a_lock_by_hand():
    """A choice is wrong if no rollout earns and the tie goes wrong: (1 - (3/4)^m / 2) (1 - (1/2)^m / 2)."""
    gorp = Gorp(lock(3), 3)
    for m in (1, 2, 3, 50, 1000):
        assert gorp.success_probability(m) == pytest.approx((1 - 0.75**m / 2) * (1 - 0.5**m / 2), rel=1e-9)
    found = gorp.rollouts()
    assert (found.rollouts, found.samples) == (2, 9 * 2 * 2)
    assert found.effective_horizon == 2
    assert Gorp(lock(3), 3, k=3).success_probability(1) == pytest.approx(1)


@pytest.mark.parametrize(("k", "m"), [(1, 1), (1, 4), (2, 2)])
def test_gorp_equals_real_rollouts(k, m):
    mdp, rng, n = random_mdp(3), np.random.default_rng(0), 400
    horizon = mdp.shortest_solution() + 1
    expected = Gorp(mdp, horizon, k).success_probability(m)
    solved = sum(play_gorp(mdp, horizon, k, m, rng) > 0 for _ in range(n))
    assert stats.binomtest(solved, n, min(expected, 1.0)).pvalue > 1e-4


def test_covering_length_of_a_lock_by_hand():
    found = covering_length(lock(3), 3)
    assert found.n_pairs == 6
    assert found.occupancy == pytest.approx(1 / 8)
    assert found.simple == pytest.approx(8 * math.log(12))
    assert found.low == 6  # ln(1/2) / ln(7/8) = 5.2
    assert found.high == 12  # 2 ((1/2)^n + (3/4)^n + (7/8)^n) is 0.546 for n = 11 and 0.467 for n = 12


def test_graph_mdp_of_graph_c():
    augmented = AugmentedGraph(NAMED_GRAPHS["c"])
    mdp = graph_mdp(augmented)
    assert (mdp.n_states, mdp.n_actions, mdp.shortest_solution()) == (9, 3, 5)
    for state in range(9):
        targets = set(augmented.edges[augmented.edges[:, 0] == state, 1].tolist())
        assert set(mdp.transitions[state].tolist()) - {state} == targets
    assert mdp.rewards.sum() == (augmented.edges[:, 1] == augmented.exit).sum()
