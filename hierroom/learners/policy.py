"""An agent's policy without its learner: what acts in an evaluation."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hierroom.learners.networks import AgentSpace
from hierroom.learners.sampling import greedy_actions, sample_actions


class Stepper(Protocol):
    """The part of a backend that acting needs."""

    def initial_states(self, n: int) -> NDArray[np.float32]:
        """States of ``n`` rooms at the start of an episode: [n, S]."""
        ...

    def step(self, codes: NDArray[np.uint8], states: NDArray[np.float32]) -> tuple[NDArray, NDArray, NDArray]:
        """One turn: codes [M, K] and states [M, S] to logits [M, A], values [M] and new states [M, S]."""
        ...


class Policy:
    """Acts in N rooms, stores nothing, and keeps recurrent states and random numbers of its own.

    It reads the weights of the learner it came from, as they are at each call.

    Args:
        stepper: computes a turn.
        space: what the agent sees and can do.
        n_rooms: rooms N.
        seed: of the sampled actions.
    """

    def __init__(self, stepper: Stepper, space: AgentSpace, n_rooms: int, seed: int) -> None:
        self._stepper = stepper
        self._space = space
        self._random = np.random.default_rng(seed)
        self._states = stepper.initial_states(n_rooms)

    def act(self, rooms: NDArray[np.integer], codes: NDArray[np.uint8], masks: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Sampled actions [M], as in training; arguments as in `Learner.act`."""
        logits = self._logits(rooms, codes, masks)
        return sample_actions(logits, masks, self._random.random(len(rooms)))[0]

    def act_greedily(
        self, rooms: NDArray[np.integer], codes: NDArray[np.uint8], masks: NDArray[np.bool_]
    ) -> NDArray[np.int64]:
        """The most probable legal actions [M]; arguments as in `Learner.act`."""
        return greedy_actions(self._logits(rooms, codes, masks), masks)

    def reset(self, rooms: NDArray[np.integer]) -> None:
        """An episode is over in these rooms [M]: their next turn starts from the initial recurrent state."""
        self._states[rooms] = self._stepper.initial_states(len(rooms))

    def _logits(
        self, rooms: NDArray[np.integer], codes: NDArray[np.uint8], masks: NDArray[np.bool_]
    ) -> NDArray[np.floating]:
        self._space.check_codes(rooms, codes)
        self._space.check_masks(rooms, masks)
        if len(rooms) == 0:
            return np.empty((0, self._space.n_actions), np.float32)
        logits, _, self._states[rooms] = self._stepper.step(codes, self._states[rooms])
        return logits
