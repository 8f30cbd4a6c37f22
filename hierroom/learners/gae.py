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
    r"""Advantages of a batch of sequences of turns.

    A turn t that lasted :math:`k_t` primitive steps is discounted as one option (Sutton, Precup & Singh 1999); the
    estimator is that of Schulman et al. (2016), equation 16, with lambda counted in turns:

    .. math::
        \delta_t &= r_t + \gamma^{k_t} (1 - \mathrm{terminated}_t) V'_t - V_t \\
        A_t &= \delta_t + \gamma^{k_t} \lambda (1 - \mathrm{ended}_t) A_{t+1}, \qquad A_T = 0

    where ended is terminated or truncated: both cut the return, but a truncated one still counts what would have come
    (Pardo et al. 2018).

    Args:
        rewards: [T, M] float, rewarded for turn t: within the turn, rewards are already discounted or summed.
        values: [T, M] float, :math:`V_t` of the observation turn t acted on.
        next_values: [T, M] float, :math:`V'_t` of the observation after turn t: of the next turn, or where the
            return was truncated of the final one; not read where terminated.
        elapsed: [T, M] int, :math:`k_t` at least 1.
        terminated: [T, M] bool, nothing comes after turn t.
        truncated: [T, M] bool, the return is cut after turn t.
        gamma: discount per primitive step, 0 to 1.
        gae_lambda: weight of longer estimates, 0 (one turn) to 1 (the whole return).

    Returns:
        [T, M] float advantages; with ``values`` added, the targets of the value function (lambda-returns).
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
