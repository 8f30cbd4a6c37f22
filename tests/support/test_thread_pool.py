"""Pools: threads in forked processes and copies, and arrays that are reused when nothing refers to them."""

import copy
import multiprocessing
import pickle
import threading

import numpy as np
import pytest
from children import TIMES_QUIET
from learner_envs import RandomEnvs, make_learner

from hierroom.goals import NAMED_GRAPHS
from hierroom.support.arrays import ArrayPool
from hierroom.support.thread_pool import MIN_ENVS_PER_THREAD, ThreadPool
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.escape_room.engine import Engine


def same_state(one, other):
    return (one.grids == other.grids).all() and (one.levels == other.levels).all()


COPIES = {"pickle": lambda thing: pickle.loads(pickle.dumps(thing)), "deepcopy": copy.deepcopy}
FORK = multiprocessing.get_context("fork")


def in_a_fork(function, *arguments):
    results = FORK.SimpleQueue()
    child = FORK.Process(target=lambda: results.put(function(*arguments)))
    child.start()
    child.join(TIMES_QUIET * 6)
    hangs = child.is_alive()
    child.kill()
    assert not hangs
    assert child.exitcode == 0
    return results.get()


def stepped(world, actions):
    world.step(actions)
    return hash((world.state.grids.tobytes(), world.state.levels.tobytes()))  # small: nobody reads before it ends


def test_thread_pool_works_in_a_forked_process():
    pool, both = ThreadPool(2), threading.Barrier(2)
    pool.each(lambda _: both.wait(), range(2))  # only now do both threads run
    assert in_a_fork(lambda: pool.each(pow, range(9), [2] * 9)) == [n * n for n in range(9)]
    assert pool.each(pow, [3, 4], [2, 2]) == [9, 16]


@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")  # Python 3.12 warns of forks with threads
def test_world_with_two_threads_steps_in_a_forked_process():
    n = 2 * MIN_ENVS_PER_THREAD
    world, actions = Engine([NAMED_GRAPHS["a"]], n, size=19, threads=2), np.arange(n) % 5
    for _ in range(50):  # until both threads run
        world.step(actions)
    there = in_a_fork(stepped, world, actions)
    assert there == stepped(world, actions)


@pytest.mark.parametrize("clone", COPIES.values(), ids=COPIES)
def test_environments_with_two_threads_can_be_copied(clone):
    n = 2 * MIN_ENVS_PER_THREAD
    envs, actions = EscapeRooms(n, "a", size=11, threads=2), np.arange(n) % 5
    envs.reset(seed=0)
    envs.step(actions)
    twin = clone(envs)
    for each in (envs, twin):
        each.step(actions)
    assert same_state(envs.turns.world.state, twin.turns.world.state)


@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")
def test_learner_with_two_threads_learns_in_a_forked_process():
    learner, envs = make_learner(num_envs=600, threads=2), RandomEnvs(600, seed=3)
    while envs.tick(learner)[-1] is None:
        pass

    def next_update():
        while (losses := envs.tick(learner)[-1]) is None:
            pass
        return losses

    there = in_a_fork(next_update)
    assert there == next_update()


@pytest.mark.parametrize("clone", COPIES.values(), ids=COPIES)
def test_copied_learner_learns_the_same_and_separately(clone):
    learner, envs = make_learner(threads=2), RandomEnvs(6, seed=3)
    for _ in range(20):
        envs.tick(learner)
    twin, twin_envs = clone(learner), copy.deepcopy(envs)
    before = learner.state_dict()["backend"]["network"]
    losses = [twin_envs.tick(twin) for _ in range(20)]
    for name, tensor in learner.network.state_dict().items():
        assert (tensor == before[name]).all(), name
    for one, other in zip([envs.tick(learner) for _ in range(20)], losses, strict=True):
        for a, b in zip(one, other, strict=True):
            np.testing.assert_array_equal(a, b)
    for name, tensor in learner.network.state_dict().items():
        assert (tensor == twin.network.state_dict()[name]).all(), name
        assert not (tensor == before[name]).all(), name


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
