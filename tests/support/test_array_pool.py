"""Arrays are reused when nothing refers to them, and never before."""

import numpy as np
import pytest

from hierroom.support.arrays import ArrayPool


def make():
    arrays = np.zeros(3), np.zeros((3, 2), np.int64), *(matrix := np.zeros((2, 3))), matrix
    return arrays, {"first": arrays[0], "again": arrays[0], "second": arrays[1]}


HOLDS = {
    "the array": lambda arrays: arrays[1],
    "a view": lambda arrays: arrays[1][0],
    "a view of a view": lambda arrays: arrays[1][0][1:],
    "a memoryview": lambda arrays: memoryview(arrays[0]),
    "one in a list": lambda arrays: [arrays[0].reshape(3, 1)],
    "a row of a matrix": lambda arrays: arrays[2],
    "a view of a row": lambda arrays: arrays[3][1:],
}


@pytest.mark.parametrize("hold", HOLDS.values(), ids=HOLDS)
def test_referenced_array_is_never_reused(hold):
    pool = ArrayPool(make)
    held = []
    for step in range(6):
        arrays, _ = pool.take()
        for array in arrays:
            array[:] = step
        held.append(hold(arrays))
        del arrays, array
    held_arrays = [np.asarray(one[0] if isinstance(one, list) else one) for one in held]
    assert [set(one.ravel().tolist()) for one in held_arrays] == [{step} for step in range(6)]


def test_unreferenced_array_is_reused():
    pool, seen = ArrayPool(make), []
    for _ in range(20):
        (first, *_), named = pool.take()
        assert named["first"] is named["again"] is first
        seen.append(first.ctypes.data)
    assert len(set(seen)) == 2
    del first, named, _
    assert len({pool.take()[0][0].ctypes.data for _ in range(5)}) == 1  # the one that the cache still has
