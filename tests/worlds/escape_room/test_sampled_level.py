"""Measures by rollouts from exact states, compared with exact numbers for levels that are small enough."""

import math

import numpy as np
import pytest
from scipy.special import softmax
from scipy.stats import kstest
from splitmix import BITS, GOLDEN, mixed

from hierroom.complexity.measures import Gorp, mdp_policy_information
from hierroom.complexity.measures.policy_information import policy_information
from hierroom.goals import GoalGraph
from hierroom.support.errors import InputError
from hierroom.worlds.escape_room import batch_kernels, measured_levels
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.layout import OUTCOME
from hierroom.worlds.escape_room.measured_levels import level_mdp, measure_levels
from hierroom.worlds.escape_room.reachable import _keys
from hierroom.worlds.escape_room.rollout_kernels import (
    drawn_action,
    normal,
    policy_rollouts,
    random_rollouts,
    state_bits,
)
from hierroom.worlds.escape_room.sampled_level import SampledLevel

A = GoalGraph.named("a")


def sampled(horizon: int, graph: GoalGraph = A, seed: int = 0) -> SampledLevel:
    return SampledLevel(Engine([graph], size=11, seed=0).state, horizon, seed)


def normal_of(bits: int) -> float:
    first, second = ((bits >> 11) + 0.5) / 2**53, (mixed(bits ^ GOLDEN) >> 11) / 2**53
    return math.sqrt(-2 * math.log(first)) * math.cos(2 * math.pi * second)


def bits_of(level: np.record) -> int:
    keys, doors = int(level.keys), int(level.doors)
    bits = mixed((int(level.row) << 16 | int(level.col) << 8 | int(level.direction)) ^ mixed(keys << 8 | doors))
    if level.can_drop:
        places = level.keys_at.tolist()
        for row, col in (places[branch] for branch in range(level.n_rooms - 1) if not keys >> branch & 1):
            bits = mixed(bits ^ ((row << 8 | col) + GOLDEN & BITS))
        for branch in level.bag[: level.bag_size].tolist():
            bits = bits if doors >> branch & 1 else mixed(bits ^ branch + 1)
    return bits


def test_the_random_policy_succeeds_as_often_as_computed():
    chance = level_mdp(A, 0, size=11).random_success(300)
    n = 100_000
    level = sampled(300)
    share = level.random_successes(level.state[:], n)[0] / n
    assert 0.005 < chance < 0.5
    assert abs(share - chance) < 4 * math.sqrt(chance * (1 - chance) / n)


def test_random_rollouts_equal_plain_python():
    level, seed, m = sampled(300), 7, 20
    start = level.state[[0, 0, 0]]
    batch_kernels.step_levels(start.levels[1:2], start.grids[1:2], np.array([1]), np.zeros(1, OUTCOME))
    start.levels["has_ended"][0] = True
    found = np.zeros(3, np.int64)
    n_steps = random_rollouts(start.levels, start.grids, m, 5, np.uint64(seed), np.zeros(1, OUTCOME), found)
    expected, steps = [0, 0, 0], 0
    for n in (1, 2):
        for rollout in range(m):
            key, one, outcome, drawn = mixed(seed ^ mixed(n * m + rollout)), start[[n]], np.zeros(1, OUTCOME), 0
            while not one.levels["has_ended"][0]:
                drawn += 1
                action = ((mixed((key + drawn * GOLDEN) & BITS) >> 32) * 5) >> 32
                batch_kernels.step_levels(one.levels, one.grids, np.array([action]), outcome)
            steps += drawn
            expected[n] += int(outcome["terminated"][0])
    assert found.tolist() == expected
    assert n_steps == steps
    assert max(expected) > 0


def test_policy_rollouts_equal_plain_python():
    level, seed, m, policies = sampled(300), 7, 6, np.array([1460, 1461], np.uint64)  # two that escape at times
    found = np.full((len(policies), m), 9.0)
    policy_rollouts(level.state.levels, level.state.grids, policies, m, 5, np.uint64(seed), np.zeros(1, OUTCOME), found)
    expected = np.zeros((len(policies), m))
    for p, policy in enumerate(policies):
        for rollout in range(m):
            one, outcome = level.state[[0]], np.zeros(1, OUTCOME)
            one.levels["key"], one.levels["n_drawn"] = mixed(seed ^ mixed(p * m + rollout)), 0
            while not one.levels["has_ended"][0]:
                action = np.array([drawn_action(one.levels[0], policy, 5)])
                batch_kernels.step_levels(one.levels, one.grids, action, outcome)
            expected[p, rollout] = outcome["terminated"][0]
    assert found.tolist() == expected.tolist()
    assert 0 < expected.mean() < 1


def test_normal_gives_standard_normal_numbers():
    values = [normal(np.uint64(mixed(i))) for i in range(20_000)]
    assert kstest(values, "norm").pvalue > 0.001
    assert [normal(np.uint64(bits)) for bits in range(100)] == pytest.approx([normal_of(bits) for bits in range(100)])


def test_drawn_actions_follow_a_softmax():
    level = sampled(60).state.levels[0]
    policy, n = np.uint64(5), 40_000
    bits = mixed(int(policy) ^ int(state_bits(level)))
    preferences = [normal(np.uint64(mixed((bits + (a + 1) * GOLDEN) & BITS))) for a in range(5)]
    level.key, level.n_drawn = 9, 0
    actions = [drawn_action(level, policy, 5) for _ in range(n)]
    assert np.bincount(actions, minlength=5) / n == pytest.approx(softmax(preferences), abs=0.01)
    for t in range(20):
        uniform = [((mixed((9 + (5 * t + a + 1) * GOLDEN) & BITS) >> 11) + 0.5) / 2**53 for a in range(5)]
        assert actions[t] == np.argmax(np.array(preferences) - np.log(-np.log(uniform)))


@pytest.mark.parametrize("can_drop", [False, True])
def test_state_bits_differ_exactly_if_states_differ(can_drop):
    world = Engine([GoalGraph((0, 0), 2)], 64, size=11, drop_key=can_drop, seed=3, max_steps=10**9)
    state, rng = world.state[np.zeros(64, int)], np.random.default_rng(0)
    of_state: dict[bytes, int] = {}
    for _ in range(400):
        actions = rng.choice(
            world.n_actions, 64, p=[0.3, 0.1, 0.1] + [0.5 / (world.n_actions - 3)] * (world.n_actions - 3)
        )
        batch_kernels.step_levels(state.levels, state.grids, actions, np.zeros(64, OUTCOME))
        for key, level in zip(_keys(state.levels), state.levels, strict=True):
            bits = int(state_bits(level))
            assert bits == bits_of(level)
            assert of_state.setdefault(key, bits) == bits
    assert len(of_state) > 500
    assert len({*of_state.values()}) == len(of_state)


@pytest.mark.slow
def test_policy_information_is_as_computed():
    level, horizon = sampled(300), 300
    returns = level.policy_returns(150, 400)
    exact = mdp_policy_information(level_mdp(A, 0, size=11), horizon, 150)
    found = policy_information(returns)
    assert found.pic == pytest.approx(exact.pic, rel=0.35)
    assert found.poic == pytest.approx(exact.poic, rel=0.35)


@pytest.mark.slow
def test_gorp_succeeds_as_often_as_computed():
    mdp, level, n = level_mdp(A, 0, size=11), sampled(120), 200
    gorp = Gorp(mdp, 120)
    for m in (1, 2, 4):
        chance = gorp.success_probability(m)
        assert abs(level.gorp_success(m, n) - chance) < 4 * math.sqrt(chance * (1 - chance) / n) + 1e-9
    exact = gorp.rollouts().rollouts
    found, too_few = level.gorp_rollouts(200, 10**9)
    assert found == too_few + 1
    assert exact / 1.6 <= found <= exact * 1.6
    assert level.gorp_rollouts(20, 1000)[0] is None, "with so few steps it gives up"


def test_the_same_seed_gives_the_same_measures():
    few = {"episodes": 100, "n_policies": 3, "policy_episodes": 5, "gorp_runs": 1, "max_steps": 0}
    one, same, other = (sampled(120, seed=seed).measure(**few) for seed in (1, 1, 2))
    assert one == same != other
    assert one.shortest == level_mdp(A, 0, size=11).shortest_solution()


def test_sampled_measures_are_about_as_computed(monkeypatch):
    monkeypatch.setattr(measured_levels, "GORP_STEPS", 10**6)
    (exact,) = measure_levels([A], 1, 100)
    monkeypatch.setattr(measured_levels, "MAX_LEVEL_STATES", 10)
    (row,) = measure_levels([A], 1, 100)
    assert row.mdp.states == exact.mdp.states
    assert row.mdp.random_success_low <= exact.mdp.random_success <= row.mdp.random_success_high
    shown = dict(zip(("states", "steps", "random", "k"), row.cells, strict=False))
    assert shown["states"] == exact.cells[0]
    assert shown["random"][0] in "~<"
    assert shown["k"] == "-"
    monkeypatch.setattr(measured_levels, "MAX_COUNTED_STATES", 10)
    assert measure_levels([A], 1, 100)[0].cells[0] == "over 1e6"


def test_invalid_sampled_level_raises_input_error():
    with pytest.raises(InputError, match=r"needs at least \d+ steps, but the horizon is 3"):
        sampled(3)
    with pytest.raises(InputError, match="the state holds 2 environments"):
        SampledLevel(Engine([A], 2).state, 100)
    with pytest.raises(InputError, match="horizon of a level must be at least 1, not 0"):
        sampled(0)
