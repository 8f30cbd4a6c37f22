"""What a policy computed for a turn: how probable each action was, and what it thought was to come."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Decision:
    """One turn of a policy in M environments.

    Args:
        envs: [M] int, the environments.
        logits: [M, A] float.
        masks: [M, A] bool, the legal actions.
        values: [M] float, the discounted return of the policy's own reward that it expected.
    """

    envs: NDArray[np.integer]
    logits: NDArray[np.floating]
    masks: NDArray[np.bool_]
    values: NDArray[np.floating]

    @property
    def probabilities(self) -> NDArray[np.floating]:
        """[M, A] the softmax over the legal actions; the others have none."""
        legal = np.where(self.masks, self.logits, -np.inf)
        weights = np.exp(legal - legal.max(axis=-1, keepdims=True))
        return weights / weights.sum(axis=-1, keepdims=True)
