"""Generalised advantage estimation for turns that last more than one step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def generalized_advantages(
    rewards: NDArray[np.floating],  # [T, M] reward of each turn, summed or discounted over its primitive steps
    values: NDArray[np.floating],  # [T, M] V of the observation on which the turn acted
    next_values: NDArray[np.floating],  # [T, M] V' of the observation after the turn, the final one where truncated
    elapsed: NDArray[np.integer],  # [T, M] k, primitive steps of the turn, at least 1
    terminated: NDArray[np.bool_],  # [T, M] whether the return ends after the turn with nothing to come
    truncated: NDArray[np.bool_],  # [T, M] whether the return is cut off after the turn although it would continue
    *,
    gamma: float,
    gae_lambda: float,
) -> NDArray[np.floating]:
    r"""Estimate the advantages [T, M] of sequences of turns; the value targets are advantages plus ``values``.

    A turn t that lasted :math:`k_t` primitive steps is discounted by :math:`\gamma^{k_t}`, like an option (Sutton,
    Precup & Singh 1999). The estimator is equation 16 of Schulman et al. (2016), with lambda applied once per turn:

    .. math::
        \delta_t &= r_t + \gamma^{k_t} (1 - \mathrm{terminated}_t) V'_t - V_t \\
        A_t &= \delta_t + \gamma^{k_t} \lambda (1 - \mathrm{ended}_t) A_{t+1}, \qquad A_T = 0

    where ended means terminated or truncated. Both end the return, but a truncated return bootstraps from the value of
    its final observation (Pardo et al. 2018).
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
