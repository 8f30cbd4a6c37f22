"""Heads, masked softmax and the clipped PPO loss in one pass over the samples, with all gradients."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hierroom.support.kernel import njit


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def heads(
    policy_hidden: NDArray[np.floating],  # [N, H]
    value_hidden: NDArray[np.floating],  # [N, H] the same array if the heads share a trunk
    policy_weight: NDArray[np.floating],  # [A, H]
    policy_bias: NDArray[np.floating],  # [A]
    value_weight: NDArray[np.floating],  # [1, H]
    value_bias: NDArray[np.floating],  # [1]
    logits: NDArray[np.floating],  # [N, A] written
    values: NDArray[np.floating],  # [N] written
) -> None:
    """Apply the policy and the value head."""
    for n in range(len(policy_hidden)):
        for action in range(len(policy_bias)):
            logits[n, action] = _dot(policy_weight, action, policy_hidden, n) + policy_bias[action]
        values[n] = _dot(value_weight, 0, value_hidden, n) + value_bias[0]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def loss_backward(
    policy_hidden: NDArray[np.floating],  # [N, H]
    value_hidden: NDArray[np.floating],  # [N, H] the same array if the heads share a trunk
    logits: NDArray[np.floating],  # [N, A] from `heads`
    values: NDArray[np.floating],  # [N] from `heads`
    policy_weight: NDArray[np.floating],  # [A, H]
    value_weight: NDArray[np.floating],  # [1, H]
    masks: NDArray[np.bool_],  # [N, A] the legal actions, at least one True in each row
    actions: NDArray[np.int64],  # [N]
    log_probs: NDArray[np.floating],  # [N] log-probabilities of the actions when they were taken
    advantages: NDArray[np.floating],  # [N] A, already normalised
    targets: NDArray[np.floating],  # [N] the value targets G
    clip: float,  # clipping range of the ratio around 1
    value_scale: float,  # weight of the value loss
    entropy_scale: float,  # weight of the entropy bonus
    scale: float,  # one divided by the number of samples of the minibatch
    d_policy_hidden: NDArray[np.floating],  # [N, H] written
    d_value_hidden: NDArray[np.floating],  # [N, H] written; the same array if the heads share a trunk
    d_policy_weight: NDArray[np.floating],  # [A, H] added to
    d_policy_bias: NDArray[np.floating],  # [A] added to
    d_value_weight: NDArray[np.floating],  # [1, H] added to
    d_value_bias: NDArray[np.floating],  # [1] added to
    sums: NDArray[np.float64],  # [5] added to: ``scale`` times the sums of the first five of `STATISTICS`
) -> None:
    r"""Compute the gradients of `torch_backend.ppo_loss`.

    With p the policy over legal actions, a the action taken, r the ratio and H the entropy, per sample and logit j:

    .. math::
        \frac{\partial L}{\partial z_j} = -A r\,[\text{not clipped}] (\delta_{ja} - p_j)
            + w_e\, p_j (\log p_j + H), \qquad \frac{\partial L}{\partial V} = w_v (V - G)
    """
    n_samples, size = policy_hidden.shape
    n_actions = logits.shape[1]
    to_float = policy_hidden.dtype.type
    policy = np.empty(n_actions)
    for n in range(n_samples):
        highest = -1e30  # finite, because fastmath assumes that there are no infinities
        for action in range(n_actions):
            if masks[n, action]:
                highest = max(highest, logits[n, action])
        total = 0.0
        for action in range(n_actions):
            policy[action] = math.exp(logits[n, action] - highest) if masks[n, action] else 0.0
            total += policy[action]
        log_total = highest + math.log(total)
        entropy = 0.0
        for action in range(n_actions):
            policy[action] /= total
            if masks[n, action]:
                entropy -= policy[action] * (logits[n, action] - log_total)
        log_ratio = logits[n, actions[n]] - log_total - log_probs[n]
        ratio = math.exp(log_ratio)
        gain = ratio * advantages[n]
        clipped_gain = min(max(ratio, 1 - clip), 1 + clip) * advantages[n]
        pull = gain if gain <= clipped_gain else 0.0  # the gradient is zero where the clipped term is smaller
        error = values[n] - targets[n]
        sums[0] -= scale * min(gain, clipped_gain)
        sums[1] += scale * 0.5 * error * error
        sums[2] += scale * entropy
        sums[3] += scale * (ratio - 1 - log_ratio)
        sums[4] += scale if abs(ratio - 1) > clip else 0.0

        d_value = to_float(scale * value_scale * error)
        d_value_bias[0] += d_value
        for j in range(size):
            d_policy_hidden[n, j] = 0
        for j in range(size):
            d_value_weight[0, j] += d_value * value_hidden[n, j]
            d_value_hidden[n, j] = d_value * value_weight[0, j]
        for action in range(n_actions):
            if not masks[n, action]:
                continue
            p, log_p = policy[action], logits[n, action] - log_total
            taken = 1.0 if action == actions[n] else 0.0
            d_logit = to_float(scale * (pull * (p - taken) + entropy_scale * p * (log_p + entropy)))
            d_policy_bias[action] += d_logit
            for j in range(size):
                d_policy_weight[action, j] += d_logit * policy_hidden[n, j]
                d_policy_hidden[n, j] += d_logit * policy_weight[action, j]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def _dot(rows, i, others, n):
    total = rows.dtype.type(0)
    for j in range(rows.shape[1]):
        total += rows[i, j] * others[n, j]
    return total
