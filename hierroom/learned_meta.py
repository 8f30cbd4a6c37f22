"""The learned meta-controller: Algorithm 1 of the paper, trained by the same learner as the controller."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from hierroom.errors import InputError
from hierroom.goal_network import GoalNetwork
from hierroom.goals import N_GOALS, NO_GOAL
from hierroom.inputs import InputColumns
from hierroom.learners import AgentSpace, Learner, Policy
from hierroom.meta import MetaController, draw, meta_seed
from hierroom.presets import TrainConfig
from hierroom.situation import Situation, seen_goals
from hierroom.step import Step
from hierroom.turns import N_META_ACTIONS, Turns

WINDOW = 100
"""Episodes over which success is counted that lets learning begin."""
SHOWN = ("policy_loss", "entropy", "approx_kl", "explained_variance")
"""Statistics of the learner that go into the metrics."""


class LearnedMeta:
    r"""Chooses goals by recurrent PPO on its own turns: a decision is one action, a goal's life one turn.

    At first the controller reaches nothing, and what follows a goal says nothing about it: goals are drawn at random
    from the mask, those seen this episode before others, until a few episodes escape. Then it learns, while the
    controller goes on learning. A goal given at step t that lived k primitive steps is paid

    .. math::  F_t = \sum_{i=0}^{k-1} f_{t+i}

    of the environment's own reward f, and what follows is discounted by :math:`\gamma^k`. Its recurrent state moves
    at its own decisions only: "this key was tried in vain" is a few turns ago and not hundreds of steps.

    Where a goal was not reached but another one was achieved during its life, the decision is learned from in
    hindsight as if the first of those had been given: see `Learner.relabel`.

    Args:
        inputs: what it is fed.
        learner: of its policy; its rooms are those it is asked about, its 14 actions the goals and 'no goal'.
        steps: primitive steps of the training, over all rooms.
        start_success: share of episodes that must escape before it learns, 0 to 1.

    Attributes:
        is_learning: whether it has begun to learn; until then goals are drawn at random.
    """

    def __init__(self, inputs: InputColumns, learner: Learner, *, steps: int, start_success: float) -> None:
        self.is_learning = start_success == 0
        self._inputs = inputs
        self._learner = learner
        self._total_steps = steps
        self._start_success = start_success
        self._steps = 0
        self._successes: deque[bool] = deque(maxlen=WINDOW)
        self._first_events = np.full(learner.n_rooms, NO_GOAL)  # [N] goal achieved first in the life under way, or -1
        self._updated: dict[str, float] = {}

    @classmethod
    def for_training(cls, config: TrainConfig) -> LearnedMeta:
        """The meta-controller of a training run.

        Raises:
            InputError: if its inputs or its learner's hyperparameters cannot be used.
        """
        inputs = InputColumns(config.meta_inputs, n_actions=6 if config.drop_key else 5)
        if not 0 <= config.meta_start_success <= 1:
            raise InputError(f"meta_start_success must be from 0 to 1, not {config.meta_start_success}")
        learner = Learner(
            AgentSpace(inputs.cardinalities, N_META_ACTIONS),
            config.rooms,
            config.meta_ppo,
            seed=meta_seed(config.seed),
            device=config.device,
            threads=config.threads,
            network=GoalNetwork,
        )
        return cls(inputs, learner, steps=config.steps, start_success=config.meta_start_success)

    def choose(
        self, observations: Mapping[str, NDArray], legal: NDArray[np.bool_], situation: Situation
    ) -> NDArray[np.integer]:
        """Goals [M] or 13 for no goal, always legal: drawn at random at first, then from the policy."""
        choices = observations["action_mask"].astype(bool)
        if self.is_learning:
            return self._learner.act(situation.indices, self._inputs.codes(situation.sight), choices)
        likely = choices.copy()
        likely[:, :N_GOALS] &= seen_goals(situation)
        return draw(np.where(likely.any(axis=1, keepdims=True), likely, choices), situation.draws)

    def learn(self, step: Step, turns: Turns) -> None:
        """Take note of a primitive step: end the turns of goals whose life it ended, and learn when enough have."""
        self._steps += len(turns)
        self._first_events = np.where(self._first_events == NO_GOAL, step.events, self._first_events)
        if self.is_learning:
            # A goal that was given before learning began is none of the learner's turns.
            self._finish(np.flatnonzero(step.option_over & self._learner.has_begun), step, turns)
        else:
            self._successes.extend(step.terminated[step.over].tolist())
            rate = sum(self._successes) / WINDOW
            self.is_learning = len(self._successes) == WINDOW and rate >= self._start_success
        self._first_events[step.option_over] = NO_GOAL
        if self._learner.ready:
            self._updated = self._learner.update(min(self._steps / self._total_steps, 1.0))

    def _finish(self, rooms: NDArray[np.integer], step: Step, turns: Turns) -> None:
        """End the turns of some rooms [M]."""
        elsewhere = rooms[~step.reached[rooms] & (self._first_events[rooms] != NO_GOAL)]
        self._learner.relabel(elsewhere, self._first_events[elsewhere])
        self._learner.finish(
            rooms,
            step.meta_rewards[rooms],
            step.meta_elapsed[rooms],
            step.terminated[rooms],
            step.truncated[rooms],
            step.over[rooms],
            self._inputs.codes(turns.final_sight(step, rooms)),
        )

    def for_play(self, rooms: int, *, seed: int) -> MetaController:
        """What it has learned, drawing goals from the policy in rooms of their own."""
        return TrainedMeta(self._inputs, self._learner.policy(rooms, seed=seed))

    @property
    def statistics(self) -> dict[str, float]:
        """Numbers for the metrics: `SHOWN` of the last update, not a number before it, and whether it learns."""
        shown = {name: self._updated.get(name, float("nan")) for name in SHOWN}
        return {"is_learning": float(self.is_learning), **shown}

    def state_dict(self) -> dict[str, Any]:
        """Everything that decides what happens next, as tensors and plain types."""
        return {
            "learner": self._learner.state_dict(),
            "steps": self._steps,
            "successes": list(self._successes),
            "first_events": torch.from_numpy(self._first_events.copy()),
            "is_learning": self.is_learning,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go back to what `state_dict` gave."""
        self._learner.load_state_dict(state["learner"])
        self._steps, self.is_learning = state["steps"], state["is_learning"]
        self._successes = deque(state["successes"], WINDOW)
        self._first_events[...] = state["first_events"].numpy()


class TrainedMeta:
    """What a `LearnedMeta` has learned: chooses goals and learns nothing.

    Args:
        inputs: what it is fed.
        policy: its policy, for as many rooms as it is asked about.
    """

    def __init__(self, inputs: InputColumns, policy: Policy) -> None:
        self._inputs = inputs
        self._policy = policy

    def reset(self, indices: NDArray[np.integer]) -> None:
        """An episode begins in these rooms [M]."""
        self._policy.reset(indices)

    def choose(
        self, observations: Mapping[str, NDArray], legal: NDArray[np.bool_], situation: Situation
    ) -> NDArray[np.integer]:
        """Goals [M] or 13 for no goal, drawn from the policy, always legal."""
        choices = observations["action_mask"].astype(bool)
        return self._policy.act(situation.indices, self._inputs.codes(situation.sight), choices)
