"""Random numbers of an episode, each a function of seed, environment, episode and a counter."""

import numpy as np

from hierroom.support.kernel import njit

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
MIX_2 = np.uint64(0x94D049BB133111EB)
INIT_A, MULT_A = np.uint32(0x43B0D7E5), np.uint32(0x931E8875)
INIT_B, MULT_B = np.uint32(0x8B51F9DD), np.uint32(0x58F38DED)
MIX_LEFT, MIX_RIGHT = np.uint32(0xCA01F9DD), np.uint32(0x4973F715)


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


@njit(cache=True, nogil=True)
def seed_states(entropy, states):
    """Write the states [N, S] uint64 that NumPy's ``SeedSequence`` generates from each row of entropy [N, K] int64.

    This is NumPy's algorithm, after O'Neill's ``seed_seq_fe`` (2015); its Python interface takes 10 microseconds a row.
    """
    words, pool = np.empty(4 + 2 * entropy.shape[1], np.uint32), np.empty(4, np.uint32)
    for n in range(entropy.shape[0]):
        n_words = 0
        for k in range(entropy.shape[1]):
            number, is_first = np.uint64(entropy[n, k]), True
            while is_first or number:
                words[n_words] = np.uint32(number & np.uint64(0xFFFFFFFF))
                number, is_first, n_words = number >> np.uint64(32), False, n_words + 1
        words[n_words:] = 0  # a missing word counts as 0
        factor = INIT_A
        for i in range(4):
            pool[i], factor = _scrambled(words[i], factor, MULT_A)
        for source in range(max(n_words, 4)):
            for i in range(4):
                if source != i:
                    value, factor = _scrambled(pool[source] if source < 4 else words[source], factor, MULT_A)
                    value = np.uint32(MIX_LEFT * pool[i]) - np.uint32(MIX_RIGHT * value)
                    pool[i] = np.uint32(value) ^ (np.uint32(value) >> np.uint32(16))
        factor = INIT_B
        for s in range(states.shape[1]):
            low, factor = _scrambled(pool[2 * s % 4], factor, MULT_B)
            high, factor = _scrambled(pool[(2 * s + 1) % 4], factor, MULT_B)
            states[n, s] = np.uint64(low) | np.uint64(high) << np.uint64(32)


@njit(cache=True)
def _scrambled(value, factor, multiplier):
    """Return a hash of 32 bits, and the factor of the next one."""
    value, factor = np.uint32(value ^ factor), np.uint32(factor * multiplier)
    value = np.uint32(value * factor)
    return np.uint32(value ^ (value >> np.uint32(16))), factor
