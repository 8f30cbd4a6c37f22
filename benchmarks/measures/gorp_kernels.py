"""GORP's choice at one state, as a compiled function."""

import math

import numpy as np
from numba import njit

SPREAD, SLACK = 10.0, 30.0
"""Numbers of successes further than SPREAD standard deviations plus SLACK from the mean have no weight."""
LEAST_MASS = 1e-290
"""Less likely numbers have no weight either: masses are computed from each other, and subnormal ones lose digits."""


@njit(cache=True)
def binomial_mass(x, m, chance):
    """Return the probability of x successes in m rollouts that each succeed with a chance strictly within 0..1."""
    log_mass = math.lgamma(m + 1.0) - math.lgamma(x + 1.0) - math.lgamma(m - x + 1.0)
    return math.exp(log_mass + x * math.log(chance) + (m - x) * math.log1p(-chance))


@njit(cache=True)
def choice_probabilities(chances, n_actions, m, nodes, node_weights):
    """Return the probability [A] that each action has the leaf with the greatest estimate; ties break at random.

    The estimate of a leaf is the mean of m returns that are 0 or 1: a binomial number divided by m. Leaves are
    independent. Let F_b be the distribution function of the greatest number of action b's leaves, and f_b its mass:

        P(a) = integral over u in 0..1 of sum over x of f_a(x) prod over b != a of (F_b(x - 1) + u f_b(x)),

    This is a polynomial in u of degree A - 1, for which a Gauss-Legendre rule with K >= A / 2 nodes is exact.

    ``chances`` [A * L] are the probabilities of return 1 after each leaf; leaves of one action are adjacent. ``nodes``
    and ``node_weights`` [K] are those of the rule on 0..1.
    """
    n_leaves = chances.shape[0] // n_actions
    low, high = np.int64(0), np.int64(0)
    for leaf in range(chances.shape[0]):
        mean, deviation = m * chances[leaf], math.sqrt(m * chances[leaf] * (1 - chances[leaf]))
        low = max(low, np.int64(mean - SPREAD * deviation - SLACK))
        high = max(high, min(m, np.int64(mean + SPREAD * deviation + SLACK)))
    below = np.ones(n_actions)  # F_b(x - 1)
    upto = np.ones((n_actions, high - low + 1))  # F_b(x) for x from low to high
    for leaf in range(chances.shape[0]):
        action, chance = leaf // n_leaves, chances[leaf]
        if chance <= 0.0:
            if low > 0:
                continue  # it is always smaller: F = 1 everywhere
            below[action] = 0.0
            continue
        if chance >= 1.0:
            below[action] = 0.0
            for x in range(high - low + 1):
                if low + x < m:
                    upto[action, x] = 0.0
            continue
        mean, deviation = m * chance, math.sqrt(m * chance * (1 - chance))
        x = max(np.int64(0), np.int64(mean - SPREAD * deviation - SLACK))
        mass = binomial_mass(x, m, chance)
        while mass < LEAST_MASS:
            x += 1
            mass = binomial_mass(x, m, chance)
        odds, total = chance / (1 - chance), 0.0
        if x > low:  # below the leaf's own range
            below[action] = 0.0
            for y in range(min(x, high + 1) - low):
                upto[action, y] = 0.0
        while x < low:
            total += mass
            mass *= (m - x) / (x + 1.0) * odds
            x += 1
        if x == low:
            below[action] *= min(total, 1.0)
        while x <= high:
            total += mass
            upto[action, x - low] *= min(total, 1.0)
            mass *= (m - x) / (x + 1.0) * odds
            x += 1
    chosen = np.zeros(n_actions)
    for x in range(high - low + 1):
        for action in range(n_actions):
            before = below[action] if x == 0 else upto[action, x - 1]
            mass = upto[action, x] - before
            if mass <= 0.0:
                continue
            for node in range(nodes.shape[0]):
                product = node_weights[node]
                for other in range(n_actions):
                    if other != action:
                        under = below[other] if x == 0 else upto[other, x - 1]
                        product *= under + nodes[node] * (upto[other, x] - under)
                chosen[action] += mass * product
    return chosen


@njit(cache=True)
def leaf_chances(leaves, leaf_steps, random_values, state, h, k, chances):
    """Write the probability of return 1 after each sequence of k actions from a state with h steps to go."""
    for leaf in range(leaves.shape[1]):
        if leaf_steps[state, leaf] <= h:
            chances[leaf] = 1.0
        else:
            chances[leaf] = random_values[h - k, leaves[state, leaf]] if h > k else 0.0


@njit(cache=True)
def success_values(transitions, leaves, leaf_steps, random_values, is_optimal, visited, k, m, nodes, node_weights):
    """Return the probability [T + 1, S] that GORP takes optimal actions only, from the states ``visited`` [T + 1, S].

    ``leaves`` [S, A ** k] is the state after each sequence of k actions. ``leaf_steps`` [S, A ** k] is its step that
    earns the reward, or a very large number if there is none. Sequences with the same first action are adjacent.
    ``random_values`` [T + 1, S] is the random policy's probability of return 1.
    """
    horizon, n_states, n_actions = random_values.shape[0] - 1, transitions.shape[0], transitions.shape[1]
    success = np.zeros((horizon + 1, n_states))
    success[0] = 1.0
    chances = np.empty(leaves.shape[1])
    for h in range(1, horizon + 1):
        for state in range(n_states):
            if not visited[h, state]:
                continue
            leaf_chances(leaves, leaf_steps, random_values, state, h, k, chances)
            chosen = choice_probabilities(chances, n_actions, m, nodes, node_weights)
            for action in range(n_actions):
                if is_optimal[h, state, action]:
                    success[h, state] += chosen[action] * success[h - 1, transitions[state, action]]
    return success
