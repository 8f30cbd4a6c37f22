"""A trained meta-controller for use in other environments and with other controllers."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hierroom.agents.ppo_agent import PPOAgent
from hierroom.support.errors import InputError
from hierroom.turns.situation import Situation


class TrainedGoals:
    """A `MetaController` that chooses goals with a trained policy and does not learn.

    Its ``seed`` and the seeds of the environments determine its random choices.
    """

    def __init__(self, trained: PPOAgent, num_envs: int, seed: int) -> None:
        if memories := trained.features.memories:
            raise InputError(
                f"this meta-controller reads what only levels of its own run remember ({', '.join(memories)}): "
                "it plays in the environments of TrainedAgent.turns alone"
            )
        self._trained, self._num_envs = trained, num_envs
        self._policy = trained.learner.policy(num_envs, seed=seed)
        self._shift = np.random.default_rng(seed).random()

    def choose(
        self, observations: Mapping[str, NDArray], legal: NDArray[np.bool_], situation: Situation
    ) -> NDArray[np.integer]:
        """Sample a goal for each of M environments, as in training.

        It depends on this object's seed and on the environment's seed, episode and turn, not on the batch.
        """
        uniforms = (situation.uniforms[:, 0] + self._shift) % 1.0
        features = self._trained.features.encode(situation)
        return self._policy.act(situation.envs, features, situation.masks, uniforms)

    def reset(self, envs: NDArray[np.integer]) -> None:
        """Reset the recurrent states of environments [M]."""
        if envs.max(initial=0) >= self._num_envs:
            made_for = f"this meta-controller was made for {self._num_envs} environments"
            raise InputError(f"{made_for}, not for environment {envs.max()}; use meta_controller(num_envs=...)")
        self._policy.reset(envs)

    def for_play(self, num_envs: int, *, seed: int) -> TrainedGoals:
        """Return the same meta-controller for other environments."""
        return TrainedGoals(self._trained, num_envs, seed)
