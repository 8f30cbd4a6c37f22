"""A meta-controller that PPO has trained, in other environments and with other controllers."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hierroom.agents.ppo_agent import PPOAgent
from hierroom.support.errors import InputError
from hierroom.turns.situation import Situation


class TrainedGoals:
    """Chooses goals as the meta-controller that was trained, and learns no more: a `MetaController`.

    With the seeds of the environments, ``seed`` fixes what it draws.
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
        """Return a goal for each of M environments, drawn as in training.

        This one's seed and an environment's seed, episode and turn fix what is drawn, in whatever batch.
        """
        uniforms = (situation.uniforms[:, 0] + self._shift) % 1.0
        features = self._trained.features.encode(situation)
        return self._policy.act(situation.envs, features, situation.masks, uniforms)

    def reset(self, envs: NDArray[np.integer]) -> None:
        """Forget the last episode of some environments [M]."""
        if envs.max(initial=0) >= self._num_envs:
            made_for = f"this meta-controller was made for {self._num_envs} environments"
            raise InputError(f"{made_for}, not for environment {envs.max()}; use meta_controller(num_envs=...)")
        self._policy.reset(envs)

    def for_play(self, num_envs: int, *, seed: int) -> TrainedGoals:
        """Return one for other environments."""
        return TrainedGoals(self._trained, num_envs, seed)
