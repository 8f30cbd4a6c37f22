"""The effective horizon and the effective planning window of a deterministic MDP.

Let Q^1 be the values of the random policy and Q^(k+1)_h(s, a) = r(s, a) + max_a' Q^k_(h-1)(s', a'). An MDP is
*k-QVI-solvable* if every policy that is greedy in Q^k is optimal: definition 5.1 of Laidlaw, Russell and Dragan,
Bridging RL Theory and Practice with the Effective Horizon, NeurIPS 2023. GORP (see `gorp`) with m_k rollouts finds an
optimal policy with probability 1/2. H_k = k + log_A m_k, and the effective horizon is H = min_k H_k (definition 5.2).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.measures import horizon_kernels as kernels
from benchmarks.measures.mdp import DeterministicMDP, Values, check_horizon


@dataclass(frozen=True)
class EffectiveHorizon:
    """The bound of theorem 5.4 on the effective horizon, for each k where it is finite and may be the least."""

    horizon: int  # number of steps T of an episode
    n_actions: int  # number of actions A
    rollouts: Mapping[int, int]  # for each k a number m of rollouts that suffices

    @property
    def min_k(self) -> int | None:
        """The least k with a bound; None if there is none. It is at least `minimum_k`, and usually equal to it."""
        return min(self.rollouts, default=None)

    @property
    def bounds(self) -> dict[int, float]:
        """H_k <= k + log_A m for each k."""
        return {k: horizon_of(k, m, self.n_actions) for k, m in self.rollouts.items()}

    @property
    def value(self) -> float:
        """The least of the bounds, but at most T, because a single rollout suffices with k = T."""
        return min([*self.bounds.values(), float(self.horizon)])


def horizon_of(k: int, rollouts: float, n_actions: int) -> float:
    """Return H_k = k + log_A m."""
    return k + math.log(rollouts) / math.log(max(n_actions, 2))


def samples_of(horizon: int, n_actions: int, effective_horizon: float) -> float:
    """Return T^2 A^H, which bounds the steps that GORP samples (lemma 5.3); ``inf`` if it overflows a float."""
    try:
        return horizon**2 * float(n_actions) ** effective_horizon
    except OverflowError:
        return math.inf


def effective_horizon(mdp: DeterministicMDP, horizon: int) -> EffectiveHorizon:
    """Return the bound on the effective horizon by theorem 5.4 of Laidlaw, Russell and Dragan (2023).

    As in the authors' program, a number m of rollouts suffices if

        m >= 16 (S_t(s) / D_t(s)^2) ln(2 T A^k)

    at every state s and time t that can be reached by actions with a higher Q^k than each suboptimal action. D_t(s) is
    the gap between the greatest Q^k and that of the best suboptimal action. S_t(s) bounds the variance of a return: the
    greatest (Q - Q_worst) (Q_best - Q_worst) after k - 1 further actions.

    Args:
        mdp: the MDP.
        horizon: number of steps T of an episode, at least 1.
    """
    values, is_optimal, table = mdp.random_values(horizon), mdp.optimal_actions(horizon), (mdp.transitions, mdp.rewards)
    worst, variances = mdp.worst_values(horizon), mdp.optimal_values(horizon)
    variances -= worst
    variances *= values - worst
    rollouts, bound, k = {}, float(horizon), 1
    while k < bound:
        kernels.look_ahead_variances(mdp.transitions, variances)  # the rewards of the actions cancel
        ratio = kernels.greatest_ratio(*table, values, variances, is_optimal, mdp.start)
        if ratio >= 0:
            sequences = math.log(2 * horizon) + k * math.log(mdp.n_actions)  # ln(2 T A^k)
            rollouts[k] = max(1, math.ceil(16 * ratio * sequences))
            bound = min(bound, horizon_of(k, rollouts[k], mdp.n_actions))
        kernels.greatest_values(*table, values, np.arange(horizon, 0, -1))
        k += 1
    return EffectiveHorizon(horizon, mdp.n_actions, rollouts)


def minimum_k(mdp: DeterministicMDP, horizon: int) -> int:
    """Return the least k at which an MDP is k-QVI-solvable (definition 5.1).

    Args:
        mdp: the MDP.
        horizon: number of steps T of an episode, at least 1.
    """
    return _backups_needed(mdp, horizon, mdp.random_values(horizon))


def effective_planning_window(mdp: DeterministicMDP, horizon: int) -> int:
    """Return the least W such that every policy that is greedy in the rewards of W steps is optimal (Q^1 = r).

    Malik, Pacchiano, Srinivasan and Li (Sample Efficient Reinforcement Learning In Continuous State Spaces, ICML 2021).

    Args:
        mdp: the MDP.
        horizon: number of steps T of an episode, at least 1.
    """
    check_horizon(mdp, horizon)
    return _backups_needed(mdp, horizon, np.zeros((horizon + 1, mdp.n_states)))


def _backups_needed(mdp: DeterministicMDP, horizon: int, values: Values) -> int:
    is_optimal, table = mdp.optimal_actions(horizon), (mdp.transitions, mdp.rewards)
    for k in range(1, horizon):
        if kernels.greedy_is_optimal(*table, values, is_optimal, mdp.start):
            return k
        kernels.greatest_values(*table, values, np.arange(horizon, 0, -1))
    return horizon
