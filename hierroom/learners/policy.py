"""A policy for evaluation: it acts with the weights of a learner and does not learn."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hierroom.learners.distributions import Categorical, distribution_of
from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.networks.scale import RunningScale


@dataclass(frozen=True, eq=False)
class Decision:
    """A policy's outputs for a turn in M environments."""

    envs: NDArray[np.integer]  # [M]
    logits: NDArray[np.floating]  # [M, A]
    masks: NDArray[np.bool_]  # [M, A] the legal actions
    values: NDArray[np.floating]  # [M] the expected discounted return of the policy's own reward

    distribution: Categorical

    @property
    def probabilities(self) -> NDArray[np.floating]:
        """Probabilities [M, A]: the softmax over the legal actions, 0 elsewhere; box actions have none."""
        return self.distribution.probabilities(self.logits, self.masks)


class Stepper(Protocol):
    """The methods of a backend that a `Policy` needs."""

    def initial_states(self, n: int) -> NDArray[np.float32]:
        """Return the recurrent states [n, S] at the start of an episode."""
        ...

    def evaluate(self, features: NDArray[np.uint8], states: NDArray[np.float32]) -> tuple[NDArray, NDArray, NDArray]:
        """Compute a turn that is not learned from: logits [M, A], values [M] and new states [M, S]."""
        ...


class Policy:
    """Acts in N environments with its own recurrent states and random numbers; it stores no turns.

    Each call uses the current weights of the learner that made it. ``decision`` is the last call's, None at first.
    """

    def __init__(
        self,
        stepper: Stepper,
        space: AgentSpace,
        num_envs: int,
        seed: int,
        return_scale: RunningScale | None = None,  # that of the values; None: they are in units of the reward
    ) -> None:
        self._stepper = stepper
        self._return_scale = return_scale
        self.space, self._distribution = space, distribution_of(space)
        self._random = np.random.default_rng(seed)
        self._states = stepper.initial_states(num_envs)
        self._n_left_out, self._kept = 0, slice(None)
        self.decision: Decision | None = None

    def act(
        self,
        envs: NDArray[np.integer],
        features: NDArray[np.uint8],
        masks: NDArray[np.bool_],
        noise: NDArray[np.float64] | None = None,  # [M, ...] of `Categorical.noise`; None: from the policy's generator
    ) -> NDArray:
        """Sample actions [M, ...] as in training; arguments as in `Learner.act`."""
        if noise is None:
            noise = self._distribution.noise(self._random, len(envs) + self._n_left_out)[self._kept]
        return self._distribution.sample(self._logits(envs, features, masks), masks, noise)[0]

    def act_greedily(self, envs: NDArray[np.integer], features: NDArray[np.uint8], masks: NDArray[np.bool_]) -> NDArray:
        """Return the most probable legal actions [M, ...]; arguments as in `Learner.act`."""
        return self._distribution.greedy(self._logits(envs, features, masks), masks)

    def reset(self, envs: NDArray[np.integer]) -> None:
        """Restore the initial recurrent state of ``envs`` [M], where an episode ended."""
        self._states[envs] = self._stepper.initial_states(len(envs))

    def next(self, begins: NDArray[np.bool_]) -> Policy:
        """Return a copy with its own recurrent states, initial where ``begins`` [N], and the same random generator."""
        policy = copy(self)
        policy._states = self._states.copy()
        if begins.any():
            policy.reset(np.flatnonzero(begins))
        return policy

    @property
    def num_envs(self) -> int:
        """Return the number of environments N."""
        return len(self._states)

    def subset(self, envs: NDArray[np.integer]) -> Policy:
        """Return a policy for some environments [M] that acts there like the whole, with the same random numbers.

        Each call of `act` must name all environments. Both share a generator, so do not use the whole afterwards.
        """
        subset = copy(self)
        n_drawn = len(self._states) + self._n_left_out
        subset._states, subset._kept = self._states[envs], np.arange(n_drawn)[self._kept][envs]
        subset._n_left_out = n_drawn - len(envs)
        return subset

    def _logits(
        self, envs: NDArray[np.integer], features: NDArray[np.uint8], masks: NDArray[np.bool_]
    ) -> NDArray[np.floating]:
        self.space.check_features(envs, features)
        self.space.check_masks(envs, masks)
        if len(envs) == 0:
            return np.empty((0, self.space.n_actions), np.float32)
        logits, values, self._states[envs] = self._stepper.evaluate(features, self._states[envs])
        if self._return_scale is not None:
            values = values / self._return_scale.factor.numpy()
        self.decision = Decision(envs, logits, masks, values, self._distribution)
        return logits
