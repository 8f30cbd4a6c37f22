"""Every turn is stored once, in order, also where environments act at different rates."""

import numpy as np
import pytest

from hierroom.learners.rollout import Rollout


def run(num_envs=5, length=4, ticks=60, seed=0):
    """Drive a rollout with turns numbered per environment; returns what was put in and the batches that came out."""
    random = np.random.default_rng(seed)
    rollout = Rollout(num_envs, length, capacity=3 + num_envs, n_features=2, n_actions=3, state_size=1)
    pace = np.linspace(0.2, 1, num_envs)
    counts = np.zeros(num_envs, int)
    ended_before = np.zeros(num_envs, bool)
    values, ends, truncated_values = ([[] for _ in range(num_envs)] for _ in range(3))
    bootstraps = {}
    batches = []
    for _ in range(ticks):
        envs = np.flatnonzero(random.random(num_envs) < pace)
        n = len(envs)
        value = random.normal(size=n).astype(np.float32)
        rollout.begin(
            envs,
            states=np.stack([counts[envs]], axis=1).astype(np.float32),
            resets=ended_before[envs],
            features=np.stack([envs, counts[envs]], axis=1).astype(np.uint8),
            masks=np.ones((n, 3), bool),
            actions=counts[envs] % 3,
            log_probs=-value,
            values=value,
        )
        terminated = random.random(n) < 0.2
        truncated = ~terminated & (random.random(n) < 0.2)
        last = np.where(truncated, random.normal(size=n), 0).astype(np.float32)
        rollout.finish(envs, 100.0 * envs + counts[envs], 1 + counts[envs], terminated, truncated, last)
        for i, env in enumerate(envs):
            values[env].append(value[i])
            ends[env].append((terminated[i], truncated[i]))
            truncated_values[env].append(last[i])
        ended_before[envs] = terminated | truncated
        counts[envs] += 1
        if len(rollout.full) >= 3:
            waiting = np.flatnonzero(rollout.awaiting >= 0)
            bootstrap = random.normal(size=num_envs).astype(np.float32)
            rollout.bootstrap(np.arange(num_envs), bootstrap)
            bootstraps |= {(env, counts[env] - 1): bootstrap[env] for env in waiting.tolist()}
            batches.append(rollout.take())
    return counts, values, ends, truncated_values, bootstraps, batches


def test_no_turn_is_lost_doubled_or_out_of_order():
    counts, *_, batches = run()
    seen = {env: [] for env in range(5)}
    for batch in batches:
        for m in range(batch.rewards.shape[1]):
            env = int(batch.features[0, m, 0])
            assert (batch.features[:, m, 0] == env).all()
            np.testing.assert_array_equal(batch.rewards[:, m], 100 * env + batch.features[:, m, 1].astype(int))
            np.testing.assert_array_equal(batch.elapsed[:, m], 1 + batch.features[:, m, 1].astype(int))
            assert batch.initial_states[m, 0] == batch.features[0, m, 1]
            seen[env].extend(batch.features[:, m, 1].tolist())
    for env, turns in seen.items():
        assert turns == list(range(len(turns)))
        assert counts[env] - len(turns) < 2 * 4 + 1, "a full sequence was left behind"
    assert len(seen[4]) > 2 * len(seen[0]) > 0, "environments were meant to keep different paces"


def test_next_values_are_the_next_turns_value_or_the_bootstrap():
    _, values, ends, truncated_values, bootstraps, batches = run(seed=1)
    n_given_by_the_next = 0
    for batch in batches:
        for m in range(batch.rewards.shape[1]):
            env = int(batch.features[0, m, 0])
            for t, turn in enumerate(batch.features[:, m, 1].tolist()):
                terminated, truncated = ends[env][turn]
                assert (batch.terminated[t, m], batch.truncated[t, m]) == (terminated, truncated)
                if terminated:
                    expected = 0.0
                elif truncated:
                    expected = truncated_values[env][turn]
                elif (env, turn) in bootstraps:
                    assert t == 3
                    expected = bootstraps[env, turn]
                else:
                    expected = values[env][turn + 1]
                    n_given_by_the_next += t == 3
                assert batch.next_values[t, m] == expected
    assert bootstraps
    assert n_given_by_the_next


def test_full_rollout_pool_raises_runtime_error():
    rollout = Rollout(1, 1, capacity=2, n_features=1, n_actions=1, state_size=1)
    env, flag, number = np.array([0]), np.zeros(1, bool), np.zeros(1, np.float32)

    def turn():
        turn = {"features": np.zeros((1, 1), np.uint8), "masks": ~flag[:, None], "resets": flag, "actions": env}
        rollout.begin(env, np.zeros((1, 1), np.float32), number, log_probs=number, **turn)
        rollout.finish(env, number, np.array([1]), flag, flag, number)

    turn(), turn()
    with pytest.raises(RuntimeError, match="update"):
        turn()
