"""Compiled rollouts of the random policy and of other policies, from given states and without views.

A rollout runs until its level has ended; ``max_steps`` and ``steps`` of the level are its horizon and its clock. It
draws from the level's own stream of random numbers, with a new key for each rollout.
"""

import math

import numpy as np

from hierroom.support.compile.kernel import copy_matrix, njit
from hierroom.worlds.escape_room.step_kernels import advance
from hierroom.worlds.random_kernels import GOLDEN, mix, random_below

UNIT = 2.0**-53


@njit(cache=True)
def normal(bits):
    """Return a standard normal number made of 64 random bits (Box & Muller 1958)."""
    first = (np.float64(bits >> np.uint64(11)) + 0.5) * UNIT
    second = np.float64(mix(bits ^ GOLDEN) >> np.uint64(11)) * UNIT
    return math.sqrt(-2.0 * math.log(first)) * math.cos(2.0 * math.pi * second)


@njit(cache=True)
def state_bits(level):
    """Return a 64-bit hash of a level's state, as defined in `reachable.reachable_states`."""
    place = np.uint64(level.row * 65536 + level.col * 256 + level.direction)
    bits = mix(place ^ mix((np.uint64(level.keys) << np.uint64(8)) | np.uint64(level.doors)))
    if level.can_drop:
        for branch in range(level.n_rooms - 1):
            if not (level.keys >> branch) & 1:
                cell = np.uint64(level.keys_at[branch, 0] * 256 + level.keys_at[branch, 1])
                bits = mix(bits ^ (cell + GOLDEN))
        for slot in range(level.bag_size):
            if not (level.doors >> level.bag[slot]) & 1:
                bits = mix(bits ^ np.uint64(level.bag[slot] + 1))
    return bits


@njit(cache=True)
def drawn_action(level, policy, n_actions):
    """Draw an action of a policy that is the softmax of normal preferences in every state.

    The largest preference after adding independent Gumbel noise has these probabilities. The preferences are computed
    from the policy's key and the state, so no table is needed.
    """
    bits, best, action = mix(policy ^ state_bits(level)), -math.inf, 0
    for candidate in range(n_actions):
        level.n_drawn += np.uint64(1)
        uniform = (np.float64(mix(level.key + level.n_drawn * GOLDEN) >> np.uint64(11)) + 0.5) * UNIT
        value = normal(mix(bits + np.uint64(candidate + 1) * GOLDEN)) - math.log(-math.log(uniform))
        if value > best:
            best, action = value, candidate
    return action


@njit(cache=True, nogil=True)
def random_rollouts(levels, grids, n_rollouts, n_actions, seed, outcomes, successes):
    """Add to ``successes`` [N] the rollouts of the random policy that escape from N states; return the steps played.

    A level that has ended has no rollouts; ``outcomes`` [1] is scratch.
    """
    scratch, grid, n_steps = levels[:1].copy(), grids[0].copy(), 0
    for n in range(levels.shape[0]):
        if levels[n].has_ended:
            continue
        for rollout in range(n_rollouts):
            scratch[0] = levels[n]
            copy_matrix(grids[n], grid)
            level = scratch[0]
            level.key, level.n_drawn = mix(seed ^ mix(np.uint64(n * n_rollouts + rollout))), np.uint64(0)
            while not level.has_ended:
                advance(level, grid, random_below(level, n_actions), outcomes[0])
                n_steps += 1
            successes[n] += outcomes[0].terminated
    return n_steps


@njit(cache=True, nogil=True)
def policy_rollouts(levels, grids, policies, n_rollouts, n_actions, seed, outcomes, returns):
    """Write the ``returns`` [P, rollouts] of policies, each given by its key [P], from one state: 1 for an escape."""
    scratch, grid = levels.copy(), grids[0].copy()
    for p in range(policies.shape[0]):
        for rollout in range(n_rollouts):
            scratch[0] = levels[0]
            copy_matrix(grids[0], grid)
            level = scratch[0]
            level.key, level.n_drawn = mix(seed ^ mix(np.uint64(p * n_rollouts + rollout))), np.uint64(0)
            while not level.has_ended:
                advance(level, grid, drawn_action(level, policies[p], n_actions), outcomes[0])
            returns[p, rollout] = outcomes[0].terminated
