"""The rollouts that GORP needs on a deterministic MDP with returns 0 or 1.

GORP (greedy over random policy; Laidlaw, Russell and Dragan 2023, algorithm 1) chooses one action after the other. It
makes m rollouts of the random policy after each of the A^k sequences of k further actions. It then takes the first
action of the sequence with the greatest mean return; ties are broken at random. With m_k rollouts it finds an optimal
policy with probability 1/2, and H_k = k + log_A m_k (definition 5.2). `effective_horizon` gives only an upper bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.measures.effective_horizon import horizon_of
from benchmarks.measures.gorp_kernels import success_values
from benchmarks.measures.mdp import DeterministicMDP, check_horizon
from hierroom.support.errors import InputError, require_number, shown

MAX_SEQUENCES = 1000
"""Most sequences of k actions, A^k. The authors have the same limit."""
MAX_ROLLOUTS = 1_000_000
NEVER = 2**62


@dataclass(frozen=True)
class GorpRollouts:
    """The number of rollouts with which GORP finds an optimal policy with probability 1/2."""

    k: int  # number of actions of a sequence
    rollouts: int | None  # m_k; None if it is more than `MAX_ROLLOUTS`
    horizon: int  # number of steps T of an episode
    n_actions: int  # number of actions A

    @property
    def effective_horizon(self) -> float:
        """H_k = k + log_A m_k; ``inf`` if m_k is not known."""
        return float("inf") if self.rollouts is None else horizon_of(self.k, self.rollouts, self.n_actions)

    @property
    def samples(self) -> float:
        """T^2 A^k m_k, which bounds the steps that GORP samples (lemma 5.3)."""
        rollouts = float("inf") if self.rollouts is None else self.rollouts
        return self.horizon**2 * float(self.n_actions) ** self.k * rollouts


class Gorp:
    """GORP on one MDP with returns 0 or 1.

    Args:
        horizon: number of steps T of an episode, at least 1.
        k: number of actions of a sequence, at least 1.
    """

    def __init__(self, mdp: DeterministicMDP, horizon: int, k: int = 1) -> None:
        check_horizon(mdp, horizon)
        if not mdp.is_binary:
            raise InputError("GORP's rollouts are computed for returns of 0 or 1; this MDP has other rewards")
        require_number("k", k, 1, is_whole=True)
        if mdp.n_actions**k > MAX_SEQUENCES:
            raise InputError(f"{mdp.n_actions}**k must be at most {MAX_SEQUENCES}, but k = {shown(k)}")
        self.mdp, self.horizon, self.k = mdp, horizon, k
        self._random = mdp.random_values(horizon)
        self._leaves, self._leaf_steps = _sequences(mdp, k)
        nodes, weights = np.polynomial.legendre.leggauss((mdp.n_actions + 1) // 2)
        self._rule = (nodes + 1) / 2, weights / 2
        self._is_optimal, self._visited = self._optimal_ways()

    def success_probability(self, m: int) -> float:
        """Return the probability that GORP finds an optimal policy with m rollouts, at most `MAX_ROLLOUTS`."""
        require_number("the number of rollouts", m, 1, MAX_ROLLOUTS, is_whole=True)
        mdp, known = self.mdp, (self._leaves, self._leaf_steps, self._random)
        success = success_values(mdp.transitions, *known, self._is_optimal, self._visited, self.k, m, *self._rule)
        return float(success[self.horizon, mdp.start])

    def rollouts(self) -> GorpRollouts:
        """Return m_k, found by doubling m and then bisecting; this assumes that the probability grows with m."""
        low, high = 0, 1
        while self.success_probability(high) < 0.5:
            if high == MAX_ROLLOUTS:
                return self._found(None)
            low, high = high, min(2 * high, MAX_ROLLOUTS)
        while high - low > 1:
            middle = (low + high) // 2
            if self.success_probability(middle) < 0.5:
                low = middle
            else:
                high = middle
        return self._found(high)

    def _found(self, rollouts: int | None) -> GorpRollouts:
        return GorpRollouts(self.k, rollouts, self.horizon, self.mdp.n_actions)

    def _optimal_ways(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return which actions are optimal [T + 1, S, A], and which states they lead to [T + 1, S]."""
        mdp, horizon = self.mdp, self.horizon
        is_optimal = mdp.optimal_actions(horizon)
        visited = np.zeros((horizon + 1, mdp.n_states), bool)
        visited[horizon, mdp.start] = True
        for h in range(horizon, 0, -1):
            visited[h - 1][mdp.transitions[visited[h]][is_optimal[h][visited[h]]]] = True
        return is_optimal, visited


def _sequences(mdp: DeterministicMDP, k: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the state after each sequence of k actions, and its first step with a reward: [S, A ** k] each."""
    leaves = np.arange(mdp.n_states)[:, None]
    steps = np.full(leaves.shape, NEVER)
    for step in range(1, k + 1):
        earns = (mdp.rewards[leaves] > 0).reshape(mdp.n_states, -1)
        steps = np.repeat(steps, mdp.n_actions, axis=1)
        steps[earns & (steps == NEVER)] = step
        leaves = mdp.transitions[leaves].reshape(mdp.n_states, -1)
    return leaves, steps
