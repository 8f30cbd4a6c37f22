"""The random numbers of an episode in Python's whole numbers, which never overflow: SplitMix64."""

GOLDEN = 0x9E3779B97F4A7C15
BITS = 2**64 - 1


def mixed(bits):
    bits = (bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9 & BITS
    bits = (bits ^ (bits >> 27)) * 0x94D049BB133111EB & BITS
    return bits ^ (bits >> 31)


def key_of(*numbers):
    """The key of an episode: seed, environment, episode."""
    key = 0
    for number in numbers:
        key = mixed(key ^ ((number + GOLDEN) & BITS))
    return key


def below(key, n, bound):
    """The n-th whole number below a bound, counted from 1."""
    return (mixed((key + n * GOLDEN) & BITS) >> 32) * bound >> 32


def shuffled(key, n_drawn, items):
    """The items in the order that the numbers after the first ``n_drawn`` give, and how many are drawn then."""
    items = [*items]
    for last in range(len(items) - 1, 0, -1):
        n_drawn += 1
        other = below(key, n_drawn, last + 1)
        items[last], items[other] = items[other], items[last]
    return items, n_drawn
