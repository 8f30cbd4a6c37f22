"""A policy for evaluation: it acts with the weights of a learner, does not learn, and keeps what it last computed."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hierroom.learners.networks.actor_critic import AgentSpace
from hierroom.learners.sampling import greedy_actions, sample_actions


@dataclass(frozen=True, eq=False)
class Decision:
    """What a policy computed for a turn in M environments."""

    envs: NDArray[np.integer]  # [M] the environments
    logits: NDArray[np.floating]  # [M, A]
    masks: NDArray[np.bool_]  # [M, A] the legal actions
    values: NDArray[np.floating]  # [M] the discounted return of the policy's own reward that it expected

    @property
    def probabilities(self) -> NDArray[np.floating]:
        """[M, A] the softmax over the legal actions; the others have none."""
        legal = np.where(self.masks, self.logits, -np.inf)
        weights = np.exp(legal - legal.max(axis=-1, keepdims=True))
        return weights / weights.sum(axis=-1, keepdims=True)


class Stepper(Protocol):
    """The methods of a backend that a `Policy` needs."""

    def initial_states(self, n: int) -> NDArray[np.float32]:
        """Recurrent states [n, S] of ``n`` environments at the start of an episode."""
        ...

    def evaluate(self, features: NDArray[np.uint8], states: NDArray[np.float32]) -> tuple[NDArray, NDArray, NDArray]:
        """Compute a turn that is not learned from: logits [M, A], values [M] and new states [M, S]."""
        ...


class Policy:
    """Acts in N environments with its own recurrent states and random numbers; it stores no turns.

    The weights are not copied: each call uses the current weights of the learner that made the policy.

    Args:
        stepper: the backend that computes a turn.
        space: observations and actions of the agent.
        num_envs: number of environments N.
        seed: seed of the sampled actions.

    Attributes:
        decision: what the last call of `act` or `act_greedily` computed; None before the first.
    """

    def __init__(self, stepper: Stepper, space: AgentSpace, num_envs: int, seed: int) -> None:
        self._stepper = stepper
        self._space = space
        self._random = np.random.default_rng(seed)
        self._states = stepper.initial_states(num_envs)
        self._n_left_out, self._kept = 0, slice(None)
        self.decision: Decision | None = None

    def act(
        self, envs: NDArray[np.integer], features: NDArray[np.uint8], masks: NDArray[np.bool_]
    ) -> NDArray[np.int64]:
        """Sample actions [M] int64 as in training; arguments as in `Learner.act`."""
        uniforms = self._random.random(len(envs) + self._n_left_out)[self._kept]
        return self.act_by(uniforms, envs, features, masks)

    def act_by(
        self,
        uniforms: NDArray[np.float64],
        envs: NDArray[np.integer],
        features: NDArray[np.uint8],
        masks: NDArray[np.bool_],
    ) -> NDArray[np.int64]:
        """As `act`, by random numbers [M] in [0, 1) that are given instead of its own."""
        return sample_actions(self._logits(envs, features, masks), masks, uniforms)[0]

    def act_greedily(
        self, envs: NDArray[np.integer], features: NDArray[np.uint8], masks: NDArray[np.bool_]
    ) -> NDArray[np.int64]:
        """Return the most probable legal actions [M] int64; arguments as in `Learner.act`."""
        return greedy_actions(self._logits(envs, features, masks), masks)

    def reset(self, envs: NDArray[np.integer]) -> None:
        """Restore the initial recurrent state of ``envs`` [M], whose episodes have ended."""
        self._states[envs] = self._stepper.initial_states(len(envs))

    def part(self, envs: NDArray[np.integer]) -> Policy:
        """The same policy in some of its environments [M], for which it draws the numbers that the whole would draw.

        Its `act` must be called with all M environments, as this one's must have been. They share the generator of
        random numbers, so this one is not to be used any more.
        """
        part = copy(self)
        n_drawn = len(self._states) + self._n_left_out
        part._states, part._kept = self._states[envs], np.arange(n_drawn)[self._kept][envs]
        part._n_left_out = n_drawn - len(envs)
        return part

    def _logits(
        self, envs: NDArray[np.integer], features: NDArray[np.uint8], masks: NDArray[np.bool_]
    ) -> NDArray[np.floating]:
        self._space.check_features(envs, features)
        self._space.check_masks(envs, masks)
        if len(envs) == 0:
            return np.empty((0, self._space.n_actions), np.float32)
        logits, values, self._states[envs] = self._stepper.evaluate(features, self._states[envs])
        self.decision = Decision(envs, logits, masks, values)
        return logits
