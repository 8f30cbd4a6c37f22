"""Arrays that are used again when nobody holds them, and never while somebody does."""

import copy
import pickle

import numpy as np
import pytest

from hierroom.support.array_pool import ArrayPool
from hierroom.vector_env import EscapeRooms


def make():
    arrays = np.zeros(3), np.zeros((3, 2), np.int64)
    return arrays, {"first": arrays[0], "again": arrays[0], "second": arrays[1]}


HOLDS = {
    "the array": lambda arrays: arrays[1],
    "a view": lambda arrays: arrays[1][0],
    "a view of a view": lambda arrays: arrays[1][0][1:],
    "a memoryview": lambda arrays: memoryview(arrays[0]),
    "one in a list": lambda arrays: [arrays[0].reshape(3, 1)],
}


@pytest.mark.parametrize("hold", HOLDS.values(), ids=HOLDS)
def test_an_array_that_is_held_in_any_way_is_never_reused(hold):
    pool = ArrayPool(make)
    held = []
    for step in range(6):
        arrays, _ = pool.take()
        for array in arrays:
            array[:] = step
        held.append(hold(arrays))
        del arrays, array
    told = [np.asarray(one[0] if isinstance(one, list) else one) for one in held]
    assert [set(one.ravel().tolist()) for one in told] == [{step} for step in range(6)]


def test_an_array_that_nobody_holds_is_reused():
    pool, seen = ArrayPool(make), []
    for _ in range(20):
        (first, _), named = pool.take()
        assert named["first"] is named["again"] is first
        seen.append(first.ctypes.data)
    assert len(set(seen)) == 2


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda pool: pickle.loads(pickle.dumps(pool))])
def test_a_copy_has_arrays_of_its_own(copied):
    pool = ArrayPool(make)
    (first, _), _ = pool.take()
    (other, _), _ = copied(pool).take()
    assert not np.shares_memory(first, other)


def test_the_steps_that_a_meta_controller_kept_stay_as_they_were():
    class Watching:
        def __init__(self):
            self.steps = []

        def choose(self, observations, legal, situation):
            return np.full(len(situation), -1)

        def observe(self, step, turns):
            self.steps.append((step, step.lengths.copy(), step.rewards))

    meta = Watching()
    envs = EscapeRooms(2, "a", size=11, max_steps=50, meta=meta)
    envs.reset(seed=0)
    for _ in range(9):
        envs.step(np.ones(2, int))
    for t, (step, lengths, rewards) in enumerate(meta.steps):
        assert step.lengths.tolist() == lengths.tolist() == [t + 1] * 2
        assert np.shares_memory(step.rewards, rewards)
