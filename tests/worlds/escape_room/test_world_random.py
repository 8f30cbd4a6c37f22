"""The random numbers of an episode against SplitMix64 in Python's whole numbers, which never overflow."""

import numpy as np
import pytest

from hierroom.worlds.escape_room.layout import LEVEL
from hierroom.worlds.random_kernels import mix, random_below, shuffle, stream_key, turn_uniforms

GOLDEN = 0x9E3779B97F4A7C15
BITS = 2**64 - 1
KEYS = (0, 1, 2**63, BITS, 0x0123456789ABCDEF)

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered")  # as plain Python the kernels tell of it


def mixed(bits):
    bits = (bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9 & BITS
    bits = (bits ^ (bits >> 27)) * 0x94D049BB133111EB & BITS
    return bits ^ (bits >> 31)


def level(key, n_drawn=0):
    records = np.zeros(1, LEVEL).view(np.recarray)
    records.key, records.n_drawn = key, n_drawn
    return records[0]


def below(key, n, bound):
    return (mixed((key + n * GOLDEN) & BITS) >> 32) * bound >> 32


def test_it_is_splitmix64():
    """The first outputs of the published generator from seed 0."""
    outputs = [0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F]
    assert [mixed(n * GOLDEN & BITS) for n in (1, 2, 3)] == outputs
    assert [int(mix(np.uint64(n * GOLDEN & BITS))) for n in (1, 2, 3)] == outputs


@pytest.mark.parametrize("numbers", [(0, 0, 0), (7, 3, 2), (2**62, 127, 2**31), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
def test_the_key_of_an_episode(numbers):
    key = 0
    for number in numbers:
        key = mixed(key ^ ((number + GOLDEN) & BITS))
    assert int(stream_key(*numbers)) == key


@pytest.mark.parametrize("key", KEYS)
def test_whole_numbers(key):
    own = level(key)
    assert [random_below(own, bound) for bound in (1, 2, 5, 64, 10**6)] == [
        below(key, n, bound) for n, bound in enumerate((1, 2, 5, 64, 10**6), start=1)
    ]
    assert own.n_drawn == 5


@pytest.mark.parametrize("key", KEYS)
def test_an_array_is_shuffled_from_its_end(key):
    expected = [*range(7)]
    for n, last in enumerate(range(6, 0, -1), start=1):
        other = below(key, n, last + 1)
        expected[last], expected[other] = expected[other], expected[last]
    items, own = np.arange(7), level(key)
    shuffle(own, items)
    assert items.tolist() == expected
    assert own.n_drawn == 6


def test_uniforms_of_turns():
    levels = np.concatenate([np.atleast_1d(level(key, n_drawn=3)) for key in KEYS]).view(np.recarray)
    turns, uniforms = np.array([0, 1, 2, 5, 10**6]), np.empty((len(KEYS), 14))
    turn_uniforms(levels, turns, uniforms)
    for key, turn, found in zip(KEYS, turns.tolist(), uniforms, strict=True):
        own = mixed(key ^ mixed((turn + GOLDEN) & BITS))
        assert found.tolist() == [(mixed((own + k * GOLDEN) & BITS) >> 11) / 2**53 for k in range(14)]
