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
from numpy.typing import ArrayLike, NDArray
from scipy.special import entr, softmax

from hierroom.complexity.measures.mdp import DeterministicMDP, check_horizon
from hierroom.support.errors import InputError, require_number, shown

MAX_RETURN, MAX_BINS, MAX_DEVIATION = 1e300, 10**9, 1e100
"""Bounds that keep differences of returns, bins and preferences finite."""


class PolicyInformation(NamedTuple):
    """Policy information capacity (PIC) and policy-optimal information capacity (POIC), in nats."""

    pic: float
    poic: float


def policy_information(returns: ArrayLike, n_bins: int = 100, temperature: float = 1.0) -> PolicyInformation:
    """Estimate both capacities from episodes of policies drawn from the prior (Furuta et al. 2021, algorithm 1).

    Let p_b be the share of a policy's returns in bin b, and H(p) = -sum_b p_b ln p_b. Then PIC = H(mean over policies
    of p) - mean over policies of H(p). POIC is the same for the two shares q = E[exp((R - R_max) / temperature)] and
    1 - q. With few episodes, both estimates are too large on average.

    Args:
        returns: [P, E] float, the returns of E episodes of each of P policies.
        n_bins: number of bins of equal width, at least 1.
        temperature: the temperature of optimality, above 0, in units of return.

    Examples:
        >>> from hierroom.complexity.measures import policy_information
        >>> always, never, at_times = [1, 1, 1, 1], [0, 0, 0, 0], [1, 0, 1, 0]
        >>> round(policy_information([always, never, at_times]).pic, 3)
        0.462
    """
    try:
        table = np.asarray(returns, float)
    except (TypeError, ValueError) as error:
        raise InputError(f"returns must be numbers of shape [policies, episodes]: {error}") from error
    if table.ndim != 2 or not table.size or not (abs(table) <= MAX_RETURN).all():
        raise InputError(
            f"returns must be numbers of at most {MAX_RETURN:.0e} in size, of shape [policies, episodes], "
            f"not {shown(returns)} of shape {table.shape}"
        )
    require_number("the number of bins", n_bins, 1, MAX_BINS, is_whole=True)
    _check_temperature(temperature)
    low, high = table.min(), table.max()
    bins = np.minimum(((table - low) / ((high - low) or 1.0) * n_bins).astype(int), n_bins - 1)
    shares = np.stack([(bins == b).mean(axis=1) for b in np.unique(bins)], axis=1)  # [P, bins used]
    with np.errstate(over="ignore"):  # far from optimal: exp(-inf) is 0
        optimality = np.exp((table - high) / temperature).mean(axis=1)
    return PolicyInformation(_information(shares), _binary_information(optimality))


def mdp_policy_information(
    mdp: DeterministicMDP,
    horizon: int,
    n_policies: int = 1000,
    *,
    deviation: float = 1.0,
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
        deviation: standard deviation of the preferences, at least 0.
        temperature: the temperature of optimality, above 0; as it goes to 0, POIC approaches PIC.

    Examples:
        >>> from hierroom.complexity.measures import DeterministicMDP, mdp_policy_information
        >>> mdp = DeterministicMDP([[0, 1], [0, 2], [2, 2]], [[0, 0], [0, 1], [0, 0]])
        >>> round(mdp_policy_information(mdp, horizon=3).pic, 3)
        0.133
    """
    check_horizon(mdp, horizon)
    if not mdp.is_binary:
        raise InputError(
            "the policy information of an MDP is computed for returns of 0 or 1; this one has other rewards"
        )
    require_number("the number of policies", n_policies, 1, is_whole=True)
    require_number("the deviation of preferences", deviation, 0, MAX_DEVIATION)
    require_number("seed", seed, 0, 2**63 - 1, is_whole=True)
    _check_temperature(temperature)
    rng, successes = np.random.default_rng(seed), []
    for _ in range(n_policies):
        policy = softmax(deviation * rng.standard_normal(mdp.transitions.shape), axis=1)
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


def _check_temperature(temperature: float) -> None:
    if not temperature > 0:
        raise InputError(f"the temperature of optimality must be above 0, not {temperature}")
