"""Random numbers of an episode, each a function of seed, environment, episode and a counter."""

import numpy as np

from hierroom.support.kernel import njit

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
MIX_2 = np.uint64(0x94D049BB133111EB)


@njit(cache=True)
def mix(bits):
    """Scramble 64 bits with the finalizer of SplitMix64 (Steele, Lea & Flood 2014), a bijection."""
    bits = (bits ^ (bits >> np.uint64(30))) * MIX_1
    bits = (bits ^ (bits >> np.uint64(27))) * MIX_2
    return bits ^ (bits >> np.uint64(31))


@njit(cache=True)
def stream_key(seed, index, episode):
    """Return the 64-bit key of an environment's episode; its i-th random number is ``mix(key + i * GOLDEN)``."""
    key = mix(np.uint64(seed) + GOLDEN)
    key = mix(key ^ (np.uint64(index) + GOLDEN))
    return mix(key ^ (np.uint64(episode) + GOLDEN))


@njit(cache=True)
def random_below(level, bound):
    """Return the episode's next random integer in ``0..bound - 1``."""
    level.n_drawn += np.uint64(1)
    bits = mix(level.key + level.n_drawn * GOLDEN)
    return np.int64(((bits >> np.uint64(32)) * np.uint64(bound)) >> np.uint64(32))


@njit(cache=True)
def shuffle(level, items):
    """Shuffle a small array in place (Fisher and Yates)."""
    for last in range(items.shape[0] - 1, 0, -1):
        other = random_below(level, last + 1)
        items[last], items[other] = items[other], items[last]


@njit(cache=True, nogil=True)
def turn_uniforms(levels, turns, uniforms):
    """Write uniforms [N, K] in [0, 1) for each environment's turn, determined by episode and turn number."""
    for n in range(levels.shape[0]):
        key = mix(levels[n].key ^ mix(np.uint64(turns[n]) + GOLDEN))
        for k in range(uniforms.shape[1]):
            uniforms[n, k] = (mix(key + np.uint64(k) * GOLDEN) >> np.uint64(11)) * 2.0**-53
