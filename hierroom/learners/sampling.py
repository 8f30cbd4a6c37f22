"""Sample actions from masked logits with uniforms that the caller provides."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hierroom.support.kernel import njit


@njit(cache=True, nogil=True)
def sample_actions(
    logits: NDArray[np.floating],  # [N, A]
    masks: NDArray[np.bool_],  # [N, A] the legal actions, at least one True in each row
    uniforms: NDArray[np.floating],  # [N] float in [0, 1)
) -> tuple[NDArray[np.int64], NDArray[np.floating]]:
    """Sample legal actions [N] from the softmax by inverse transform; also return their log-probabilities [N]."""
    num_envs, n_actions = logits.shape
    actions = np.empty(num_envs, np.int64)
    log_probs = np.empty(num_envs, logits.dtype)
    for env in range(num_envs):
        highest = -math.inf
        for action in range(n_actions):
            if masks[env, action] and logits[env, action] > highest:
                highest = logits[env, action]
        total = 0.0
        for action in range(n_actions):
            if masks[env, action]:
                total += math.exp(logits[env, action] - highest)
        left = uniforms[env] * total
        # Rounding can leave a small remainder after the last legal action; then choose that action.
        chosen = -1
        for action in range(n_actions):
            if masks[env, action]:
                chosen = action
                left -= math.exp(logits[env, action] - highest)
                if left < 0:
                    break
        actions[env] = chosen
        log_probs[env] = logits[env, chosen] - highest - math.log(total)
    return actions, log_probs


def log_probabilities(
    logits: NDArray[np.floating], masks: NDArray[np.bool_], actions: NDArray[np.integer]
) -> NDArray[np.floating]:
    """Return log-probabilities [N] of actions [N] in the softmax over legal actions; minus infinity if illegal."""
    legal = np.where(masks, logits, -np.inf)
    highest = legal.max(axis=-1)
    totals = np.log(np.exp(legal - highest[:, None]).sum(axis=-1))
    return legal[np.arange(len(actions)), actions] - highest - totals


def greedy_actions(logits: NDArray[np.floating], masks: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the most probable legal action [N] of each environment, the first one in a tie."""
    return np.where(masks, logits, -np.inf).argmax(axis=-1)
