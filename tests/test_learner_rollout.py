"""Every turn is stored once, in order, whatever pace the rooms keep."""

import numpy as np
import pytest

from hierroom.learners.rollout import Rollout


def run(n_rooms=5, length=4, ticks=60, seed=0):
    """Drive a rollout with turns numbered per room; returns what was put in and the batches that came out."""
    random = np.random.default_rng(seed)
    rollout = Rollout(n_rooms, length, capacity=3 + n_rooms, n_columns=2, n_actions=3, state_size=1)
    pace = np.linspace(0.2, 1, n_rooms)
    counts = np.zeros(n_rooms, int)
    ended_before = np.zeros(n_rooms, bool)
    values, ends, bootstraps = ([[] for _ in range(n_rooms)] for _ in range(3))
    batches = []
    for _ in range(ticks):
        rooms = np.flatnonzero(random.random(n_rooms) < pace)
        n = len(rooms)
        value = random.normal(size=n).astype(np.float32)
        rollout.begin(
            rooms,
            states=np.stack([counts[rooms]], axis=1).astype(np.float32),
            resets=ended_before[rooms],
            codes=np.stack([rooms, counts[rooms]], axis=1).astype(np.uint8),
            masks=np.ones((n, 3), bool),
            actions=counts[rooms] % 3,
            log_probs=-value,
            values=value,
        )
        terminated = random.random(n) < 0.2
        truncated = ~terminated & (random.random(n) < 0.2)
        bootstrap = np.where(truncated, random.normal(size=n), 0).astype(np.float32)
        rollout.finish(rooms, 100.0 * rooms + counts[rooms], 1 + counts[rooms], terminated, truncated, bootstrap)
        for i, room in enumerate(rooms):
            values[room].append(value[i])
            ends[room].append((terminated[i], truncated[i]))
            bootstraps[room].append(bootstrap[i] if truncated[i] else None)
        ended_before[rooms] = terminated | truncated
        counts[rooms] += 1
        if rollout.n_full >= 3:
            lacking = np.flatnonzero(rollout.awaiting >= 0)
            following = random.normal(size=len(lacking)).astype(np.float32)
            rollout.bootstrap(lacking, following)
            for room, value_of_next in zip(lacking, following, strict=True):
                bootstraps[room][-1] = value_of_next
            batches.append(rollout.take())
    return counts, values, ends, bootstraps, batches


def test_no_turn_is_lost_doubled_or_out_of_order():
    counts, _, _, _, batches = run()
    seen = {room: [] for room in range(5)}
    for batch in batches:
        for m in range(batch.rewards.shape[1]):
            room = int(batch.codes[0, m, 0])
            assert (batch.codes[:, m, 0] == room).all()
            np.testing.assert_array_equal(batch.rewards[:, m], 100 * room + batch.codes[:, m, 1].astype(int))
            np.testing.assert_array_equal(batch.elapsed[:, m], 1 + batch.codes[:, m, 1].astype(int))
            assert batch.initial_states[m, 0] == batch.codes[0, m, 1]
            seen[room].extend(batch.codes[:, m, 1].tolist())
    for room, turns in seen.items():
        assert turns == list(range(len(turns)))
        assert counts[room] - len(turns) < 2 * 4 + 1, "a full sequence was left behind"
    assert len(seen[4]) > 2 * len(seen[0]) > 0, "rooms were meant to keep different paces"


def test_next_values_are_the_next_turns_value_or_the_bootstrap():
    _, values, ends, bootstraps, batches = run(seed=1)
    for batch in batches:
        for m in range(batch.rewards.shape[1]):
            room = int(batch.codes[0, m, 0])
            for t, turn in enumerate(batch.codes[:, m, 1].tolist()):
                terminated, truncated = ends[room][turn]
                assert (batch.terminated[t, m], batch.truncated[t, m]) == (terminated, truncated)
                if terminated:
                    expected = 0.0
                elif bootstraps[room][turn] is not None:
                    expected = bootstraps[room][turn]
                else:
                    assert not truncated
                    expected = values[room][turn + 1]
                assert batch.next_values[t, m] == expected


def test_the_pool_says_so_when_nobody_takes():
    rollout = Rollout(1, 1, capacity=2, n_columns=1, n_actions=1, state_size=1)
    room, flag, number = np.array([0]), np.zeros(1, bool), np.zeros(1, np.float32)

    def turn():
        codes = np.zeros((1, 1), np.uint8)
        rollout.begin(room, np.zeros((1, 1), np.float32), flag, codes, ~flag[:, None], room, number, number)
        rollout.finish(room, number, np.array([1]), flag, flag, number)

    turn(), turn()
    with pytest.raises(RuntimeError, match="update"):
        turn()
