"""The random numbers of an episode, compared with SplitMix64 in Python's integers, which never overflow, or numpy's."""

import numpy as np
import pytest
from splitmix import BITS, GOLDEN, key_of, mixed, shuffled

from hierroom.worlds.base_view import episode_states
from hierroom.worlds.escape_room.layout import LEVEL
from hierroom.worlds.random_kernels import mix, shuffle, stream_key, turn_uniforms
from hierroom.worlds.task.replayer import seeds_of

KEYS = (0, 1, 2**63, BITS, 0x0123456789ABCDEF)

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered")  # as plain Python the kernels warn of it


def level(key, n_drawn=0):
    records = np.zeros(1, LEVEL).view(np.recarray)
    records.key, records.n_drawn = key, n_drawn
    return records[0]


def test_mix_equals_splitmix64():
    """The first outputs of the published generator from seed 0."""
    outputs = [0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F]
    assert [mixed(n * GOLDEN & BITS) for n in (1, 2, 3)] == outputs
    assert [int(mix(np.uint64(n * GOLDEN & BITS))) for n in (1, 2, 3)] == outputs


@pytest.mark.parametrize("numbers", [(0, 0, 0), (7, 3, 2), (2**62, 127, 2**31), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
def test_stream_key_equals_plain_python(numbers):
    assert int(stream_key(*numbers)) == key_of(*numbers)


@pytest.mark.parametrize("key", KEYS)
def test_shuffle_equals_plain_python(key):
    items, own = np.arange(7), level(key)
    shuffle(own, items)
    assert (items.tolist(), own.n_drawn) == shuffled(key, 0, range(7))


def test_turn_uniforms_equal_plain_python():
    levels = np.concatenate([np.atleast_1d(level(key, n_drawn=3)) for key in KEYS]).view(np.recarray)
    turns, uniforms = np.array([0, 1, 2, 5, 10**6]), np.empty((len(KEYS), 14))
    turn_uniforms(levels, turns, uniforms)
    for key, turn, found in zip(KEYS, turns.tolist(), uniforms, strict=True):
        own = mixed(key ^ mixed((turn + GOLDEN) & BITS))
        assert found.tolist() == [(mixed((own + k * GOLDEN) & BITS) >> 11) / 2**53 for k in range(14)]


def test_states_are_those_of_numpys_seed_sequence():
    bits = np.random.default_rng(0).integers(1, 63, (200, 5))
    rows = np.random.default_rng(1).integers(0, 1 << bits)
    found = episode_states(rows[:, :3], 6, 2, rows[:, 3], rows[:, 4])
    for (*episode, turn, other), states in zip(rows.tolist(), found, strict=True):
        assert np.array_equal(np.random.SeedSequence([*episode, 2, turn, other]).generate_state(6, np.uint64), states)
    episodes = [[0, 0, 0], [2**32, 3, 1], [2**63 - 1, 0, 2**32 - 1]]
    seeds = [np.random.SeedSequence([*one, 1, 0]).generate_state(1).item() for one in episodes]
    assert seeds_of(np.array(episodes), "training") == seeds
