"""The scale of an agent's rewards."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray

from hierroom.learners.networks.scale import RunningScale


class ReturnScale:
    r"""Divides rewards by the running deviation of returns, so that the unit of rewards does not matter.

    The returns are those before each turn, :math:`R_t = \gamma^{k_t} R_{t-1} + r_t`, as in VecNormalize of
    Stable-Baselines3. Here the deviation changes only at updates, and has no lower bound. While all returns were equal,
    rewards stay as they are.
    """

    def __init__(self, num_envs: int, gamma: float) -> None:
        self.scale = RunningScale(np.full(1, -np.inf), np.full(1, np.inf))
        self._gamma = gamma
        self._returns = np.zeros(num_envs)  # [N] R
        self._sums = np.zeros(3)  # number, sum and sum of squares of the returns since the last update

    def add(
        self,
        envs: NDArray[np.integer],  # [M]
        rewards: NDArray[np.floating],  # [M]
        elapsed: NDArray[np.integer],  # [M] primitive steps of the turn
        ended: NDArray[np.bool_],  # [M] whether the return ends here
    ) -> None:
        """Add the rewards of turns."""
        returns = self._returns[envs] * self._gamma**elapsed + rewards
        self._sums += len(returns), returns.sum(), (returns**2).sum()
        self._returns[envs] = np.where(ended, 0, returns)

    def scaled(self, rewards: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the rewards of an update, scaled by the deviation of all returns until now."""
        count, total, squares = self._sums
        if count:
            mean = np.array([total / count])
            self.scale.add(count, mean, np.maximum(squares - count * mean**2, 0))
            self._sums[...] = 0
        return rewards * self.scale.factor.cpu().numpy()

    def state_dict(self) -> dict[str, torch.Tensor]:
        """Return what the network's state lacks."""
        return {"returns": torch.from_numpy(self._returns.copy()), "return_sums": torch.from_numpy(self._sums.copy())}

    def load_state_dict(self, state: dict[str, torch.Tensor]) -> None:
        """Restore what `state_dict` returned."""
        self._returns[...], self._sums[...] = state["returns"].numpy(), state["return_sums"].numpy()
