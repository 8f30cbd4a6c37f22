"""The covering length: the episodes that the random policy needs to try every action in every state."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from benchmarks.measures.mdp import DeterministicMDP, check_horizon

LEAST_CHANCE = 1e-300
"""The inverses of smaller numbers may overflow a float."""


@dataclass(frozen=True)
class CoveringLength:
    """Bounds on the covering length L, in episodes; all are ``inf`` if a pair is less likely than `LEAST_CHANCE`.

    With probability 1/2, L episodes of the random policy try every pair of a state and an action. Even-Dar and Mansour
    (Learning Rates for Q-learning, JMLR 2003) count steps; Laidlaw et al. (2023) count episodes, as here.
    """

    low: float  # lower bound: with fewer episodes, the hardest pair alone is missed with probability above 1/2
    high: float  # upper bound, by the union bound over the pairs
    simple: float  # ln(2 S A) / d, the bound of Laidlaw et al., which is above ``high``
    occupancy: float  # d, the least over all pairs of the greatest probability to try the pair at one fixed step
    n_pairs: int  # number of pairs S A


def covering_length(mdp: DeterministicMDP, horizon: int) -> CoveringLength:
    """Return bounds on the covering length; absorbing states and pairs out of reach within the horizon do not count.

    Let d_t(s, a) be the probability that step t takes action a in state s. An episode tries a pair with probability p,
    where max_t d_t <= p <= min(1, sum_t d_t). L is at least ln(1/2) / ln(1 - p) for each pair, and at most the least n
    with sum over the pairs of (1 - p)^n <= 1/2.

    Args:
        mdp: the MDP.
        horizon: number of steps T of an episode, at least 1.
    """
    check_horizon(mdp, horizon)
    occupancy = np.zeros(mdp.n_states)
    occupancy[mdp.start] = 1.0
    greatest, total = occupancy.copy(), occupancy.copy()
    targets = mdp.transitions.ravel()
    for _ in range(horizon - 1):
        occupancy = np.bincount(targets, np.repeat(occupancy / mdp.n_actions, mdp.n_actions), mdp.n_states)
        greatest, total = np.maximum(greatest, occupancy), total + occupancy
    counts = (greatest > 0) & ~mdp.is_absorbing
    least, most = greatest[counts] / mdp.n_actions, np.minimum(1.0, total[counts] / mdp.n_actions)
    n_pairs = int(counts.sum()) * mdp.n_actions
    if n_pairs == 0:
        return CoveringLength(0.0, 0.0, 0.0, 1.0, 0)
    if least.min() < LEAST_CHANCE:
        return CoveringLength(math.inf, math.inf, math.inf, float(least.min()), n_pairs)
    rarest = most.min()
    low = 1.0 if rarest >= 0.5 else math.ceil(math.log(0.5) / math.log1p(-rarest))
    simple = math.log(2 * n_pairs) / float(least.min())
    return CoveringLength(low, _union_bound(least, mdp.n_actions, low, simple), simple, float(least.min()), n_pairs)


def _union_bound(chances: np.ndarray, n_actions: int, low: float, high: float) -> float:
    """Return the number of episodes after which the chances to miss each pair add up to 1/2, to a relative 1e-6."""
    with np.errstate(divide="ignore"):  # a pair that is tried for sure is never missed: exp(-inf) is 0
        logs = np.log1p(-chances)
    low, high = math.floor(low / 2), math.ceil(high)
    while high - low > max(1, 1e-6 * high):
        middle = (low + high) // 2
        if n_actions * np.exp(float(middle) * logs).sum() > 0.5:
            low = middle
        else:
            high = middle
    return high
