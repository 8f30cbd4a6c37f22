"""An agent's policy without its learner: what acts in an evaluation."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.sampling import greedy_actions, sample_actions


class Stepper(Protocol):
    """The part of a backend that acting needs."""

    def initial_states(self, n: int) -> NDArray[np.float32]:
        """States of ``n`` environments at the start of an episode: [n, S]."""
        ...

    def step(self, features: NDArray[np.uint8], states: NDArray[np.float32]) -> tuple[NDArray, NDArray, NDArray]:
        """One turn: features [M, K] and states [M, S] to logits [M, A], values [M] and new states [M, S]."""
        ...


class Policy:
    """Acts in N environments, stores nothing, and keeps recurrent states and random numbers of its own.

    It reads the weights of the learner it came from, as they are at each call.

    Args:
        stepper: computes a turn.
        space: what the agent sees and can do.
        num_envs: environments N.
        seed: of the sampled actions.
    """

    def __init__(self, stepper: Stepper, space: AgentSpace, num_envs: int, seed: int) -> None:
        self._stepper = stepper
        self._space = space
        self._random = np.random.default_rng(seed)
        self._states = stepper.initial_states(num_envs)

    def act(
        self, envs: NDArray[np.integer], features: NDArray[np.uint8], masks: NDArray[np.bool_]
    ) -> NDArray[np.int64]:
        """Sampled actions [M], as in training; arguments as in `Learner.act`."""
        logits = self._logits(envs, features, masks)
        return sample_actions(logits, masks, self._random.random(len(envs)))[0]

    def act_greedily(
        self, envs: NDArray[np.integer], features: NDArray[np.uint8], masks: NDArray[np.bool_]
    ) -> NDArray[np.int64]:
        """The most probable legal actions [M]; arguments as in `Learner.act`."""
        return greedy_actions(self._logits(envs, features, masks), masks)

    def reset(self, envs: NDArray[np.integer]) -> None:
        """An episode ended in these environments [M]: their next turn starts from the initial recurrent state."""
        self._states[envs] = self._stepper.initial_states(len(envs))

    def _logits(
        self, envs: NDArray[np.integer], features: NDArray[np.uint8], masks: NDArray[np.bool_]
    ) -> NDArray[np.floating]:
        self._space.check_features(envs, features)
        self._space.check_masks(envs, masks)
        if len(envs) == 0:
            return np.empty((0, self._space.n_actions), np.float32)
        logits, _, self._states[envs] = self._stepper.step(features, self._states[envs])
        return logits
