"""Policy information capacity: the information of a policy's parameters about its return, or about its success.

Furuta, Matsushima, Kozuno, Matsuo, Levine, Nachum and Gu (Policy Information Capacity, ICML 2021) define, for
parameters Theta drawn from a prior and the return R of an episode,

    PIC  = I(R; Theta) = H(R) - E[H(R | Theta)],
    POIC = I(O; Theta), where P(O = 1 | R) = exp((R - R_max) / temperature).

Both are in nats. The more the parameters determine, the easier it is to distinguish good ones from bad ones.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import entr, softmax

from benchmarks.measures.mdp import DeterministicMDP, check_horizon
from hierroom.support.errors import InputError


class PolicyInformation(NamedTuple):
    """Policy information capacity (PIC) and policy-optimal information capacity (POIC), in nats."""

    pic: float
    poic: float


def policy_information(
    mdp: DeterministicMDP,
    horizon: int,
    n_policies: int = 1000,
    temperature: float = 1.0,
    seed: int = 0,
) -> PolicyInformation:
    """Return both capacities on an MDP with returns 0 or 1, for policies drawn from a prior (Furuta et al. 2021).

    For the policies' probabilities p of return 1, and H(p) = -p ln p - (1 - p) ln(1 - p),

        PIC = H(mean of p) - mean of H(p), and POIC is the same of p + (1 - p) exp(-1 / temperature).

    The prior draws an independent normal preference for each state and action. A policy takes action a in state s with
    probability softmax(preferences(s))_a. Only the draw of the policies is random.

    Args:
        horizon: number of steps T of an episode, at least 1.
        n_policies: number of policies drawn, at least 1.
        temperature: the temperature of optimality, above 0; as it goes to 0, POIC approaches PIC.
    """
    check_horizon(mdp, horizon)
    if not mdp.is_binary:
        raise InputError(
            "the policy information of an MDP is computed for returns of 0 or 1; this one has other rewards"
        )
    rng, successes = np.random.default_rng(seed), []
    for _ in range(n_policies):
        policy = softmax(rng.standard_normal(mdp.transitions.shape), axis=1)
        values = np.zeros(mdp.n_states)
        for _ in range(horizon):
            values = np.einsum("sa,sa->s", policy, mdp.rewards + values[mdp.transitions])
        successes.append(values[mdp.start])
    chances = np.clip(successes, 0.0, 1.0)
    optimality = chances + (1 - chances) * np.exp(-1 / temperature)
    return PolicyInformation(_binary_information(chances), _binary_information(optimality))


def _binary_information(chances: NDArray[np.float64]) -> float:
    return _information(np.stack([chances, 1 - chances], axis=1))


def _information(shares: NDArray[np.float64]) -> float:
    """Return I(X; Theta), given the distributions of X [P, X] for P equally likely parameters."""
    return max(0.0, float(entr(shares.mean(axis=0)).sum() - entr(shares).sum(axis=1).mean()))
