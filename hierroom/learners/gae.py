"""Generalised advantage estimation for turns that last more than one step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def generalized_advantages(
    rewards: NDArray[np.floating],
    values: NDArray[np.floating],
    next_values: NDArray[np.floating],
    elapsed: NDArray[np.integer],
    terminated: NDArray[np.bool_],
    truncated: NDArray[np.bool_],
    *,
    gamma: float,
    gae_lambda: float,
) -> NDArray[np.floating]:
    r"""Estimate the advantages of a batch of sequences of turns.

    A turn t that lasted :math:`k_t` primitive steps is discounted by :math:`\gamma^{k_t}`, like an option (Sutton,
    Precup & Singh 1999). The estimator is equation 16 of Schulman et al. (2016), with lambda applied once per turn:

    .. math::
        \delta_t &= r_t + \gamma^{k_t} (1 - \mathrm{terminated}_t) V'_t - V_t \\
        A_t &= \delta_t + \gamma^{k_t} \lambda (1 - \mathrm{ended}_t) A_{t+1}, \qquad A_T = 0

    where ended means terminated or truncated. Both end the return, but a truncated return bootstraps from the value of
    its final observation (Pardo et al. 2018).

    Args:
        rewards: [T, M] float, reward of turn t; the rewards of its primitive steps are already summed or discounted.
        values: [T, M] float, :math:`V_t` of the observation on which turn t acted.
        next_values: [T, M] float, :math:`V'_t` of the observation after turn t: that of the next turn, or the final one
            where the return was truncated; ignored where terminated.
        elapsed: [T, M] int, :math:`k_t`, at least 1.
        terminated: [T, M] bool, whether the return ends after turn t with nothing to come.
        truncated: [T, M] bool, whether the return is cut off after turn t although it would continue.
        gamma: discount per primitive step, 0 to 1.
        gae_lambda: lambda, from 0 (one-turn estimates) to 1 (whole returns).

    Returns:
        [T, M] float advantages; the targets of the value function (lambda-returns) are advantages plus ``values``.
    """
    discounts = np.power(values.dtype.type(gamma), elapsed, dtype=values.dtype)  # [T, M]
    deltas = rewards + discounts * np.where(terminated, 0, next_values) - values
    carries = discounts * gae_lambda * ~(terminated | truncated)
    advantages = np.empty_like(values)
    following = np.zeros_like(values[0])
    for t in range(len(values) - 1, -1, -1):
        following = deltas[t] + carries[t] * following
        advantages[t] = following
    return advantages
