"""Options: when one ends, and the ledger of the two agents' turns.

``meta_0`` acts at reset and whenever its option ends: its goal is reached, its horizon has run out or the episode has
ended. ``controller_0`` acts at every other moment, one primitive step a turn.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.controller import Observation
from hierroom.goals import NO_GOAL
from hierroom.step import NO_OUTCOME, Step
from hierroom.world.layout import State

META, CONTROLLER = "meta_0", "controller_0"
AGENTS = (META, CONTROLLER)
"""The agents in the order in which they act."""


@dataclass(frozen=True)
class Transition:
    """The turns of one agent that a primitive step ended: in M of the N environments, or in none.

    Args:
        step: the primitive step, of all N environments.
        envs: [M] int, the environments.
        goals: [M] int, the goal ids pursued, or -1.
        rewards: [M] float64, the agent's rewards for its turns.
        elapsed: [M] int, primitive steps that the turns lasted.
        terminated: [M] bool, the agent's return ends here and nothing is to come.
        truncated: [M] bool, the agent's return is cut here, but more would have come.
        episode_ended: [M] bool.
        achieved_instead: [M] int, the goal achieved first in an option that did not reach its own, or -1.
        last_observation: from some of the turns (indices into M) to what the agent observed last in them, with the
            goal of the turn: before an environment was reset and before the next goal was chosen.
    """

    step: Step
    envs: NDArray[np.integer]
    goals: NDArray[np.integer]
    rewards: NDArray[np.float64]
    elapsed: NDArray[np.integer]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    episode_ended: NDArray[np.bool_]
    achieved_instead: NDArray[np.integer]
    last_observation: Callable[[NDArray[np.integer]], Observation]


def transitions(
    step: Step, last_observation: Callable[[str, NDArray[np.integer]], Observation]
) -> dict[str, Transition]:
    """The turns that a primitive step ended, by agent: the meta-controller's options, and a turn everywhere else.

    Args:
        step: the primitive step.
        last_observation: from an agent and some environments to what it observed last in the turns that ended there.
    """
    envs, episode_ended = np.arange(len(step.actions)), step.episode_ended
    options = np.flatnonzero(step.option_ended)
    return {
        META: Transition(
            step,
            options,
            step.goals[options],
            step.meta_rewards[options],
            step.meta_elapsed[options],
            step.terminated[options],
            step.truncated[options] & ~step.terminated[options],
            episode_ended[options],
            step.achieved_instead[options],
            lambda rows: last_observation(META, options[rows]),
        ),
        CONTROLLER: Transition(
            step,
            envs,
            step.goals,
            step.rewards,
            np.ones(len(envs), np.int64),
            step.return_terminated,
            step.return_truncated,
            episode_ended,
            np.full(len(envs), NO_GOAL),
            lambda rows: last_observation(CONTROLLER, envs[rows]),
        ),
    }


def goal_reached(outcomes: np.ndarray, goals: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Whether a step reached the goals that were pursued.

    'No goal' asks for something new: a key, door or exit that is achieved, or comes into view, for the first time this
    episode.

    Args:
        outcomes: [N] records of `layout.OUTCOME`, what came of the step.
        goals: [N] int, goal ids or -1.

    Returns:
        [N] bool.
    """
    is_new = outcomes["is_first"] | outcomes["is_discovery"]
    return np.where(goals == NO_GOAL, is_new, outcomes["event"] == goals)


@dataclass
class Ledger:
    """Where the turns in N environments stand.

    Args:
        is_meta_turn: [N] bool, where the meta-controller is to act next.
        goals: [N] int, the goal ids pursued, or -1.
        last_goals: [N] int, the goal ids pursued before, or -1.
        last_outcomes: [N] int, how those options ended: ``NO_OUTCOME``, ``REACHED``, ``TIMED_OUT`` or ``OTHER``.
        first_events: [N] int, the goal ids achieved first in the options under way, or -1.
        meta_turns: [N] int, turns the meta-controller took this episode.
        option_steps: [N] int, primitive steps since the meta-controller's last turn.
        option_rewards: [N] float64, extrinsic reward since then.
        previous_actions: [N] int, the controller's last actions; the number of actions before the first, and where it
            was none of them.
        illegal_goals: [N] int, actions of the meta-controller this episode that were not legal.
        illegal_actions: [N] int, actions of the controller this episode that its environment does not have.
        shortest: [N] int, the shortest possible lengths of the episodes under way, or -1 if they are not measured.
    """

    is_meta_turn: NDArray[np.bool_]
    goals: NDArray[np.integer]
    last_goals: NDArray[np.integer]
    last_outcomes: NDArray[np.integer]
    first_events: NDArray[np.integer]
    meta_turns: NDArray[np.integer]
    option_steps: NDArray[np.integer]
    option_rewards: NDArray[np.float64]
    previous_actions: NDArray[np.integer]
    illegal_goals: NDArray[np.integer]
    illegal_actions: NDArray[np.integer]
    shortest: NDArray[np.integer]

    @classmethod
    def at_reset(cls, num_envs: int, n_actions: int) -> Ledger:
        """The ledger of N environments whose episodes begin; the controller has ``n_actions`` actions."""
        return cls(**{name: np.full(num_envs, value) for name, value in reset_values(n_actions).items()})

    def put(self, values: Mapping[str, Any], envs: NDArray[np.integer] | slice = slice(None)) -> None:
        """Put values by name, one for each environment or one for all of them, into some environments."""
        for name, value in values.items():
            getattr(self, name)[envs] = value

    def get_state(self) -> dict[str, NDArray]:
        """The values by name, as fresh arrays."""
        return {name: array.copy() for name, array in vars(self).items()}

    def begin_options(self, envs: NDArray[np.integer], goals: NDArray[np.integer]) -> None:
        """Take the meta-controller's turn in some environments [M]: pursue these goals [M], -1 for none."""
        self.goals[envs] = goals
        self.meta_turns[envs] += 1
        self.is_meta_turn[envs] = False

    def record(
        self,
        actions: NDArray[np.int64],
        outcomes: NDArray,
        *,
        return_ends_with_option: bool,
        subgoal_horizon: int,
        n_actions: int,
        before: State | None = None,
        after: State | None = None,
    ) -> Step:
        """Take the controller's turn in every environment, and end the options that it ends.

        Args:
            actions: [N] its actions.
            outcomes: [N] records of `layout.OUTCOME`: what came of them.
            return_ends_with_option: whether no reward after an option depends on what the controller did in it.
            subgoal_horizon: steps after which an option ends without its goal.
            n_actions: the controller's number of actions.
            before: as for `Step`.
            after: likewise.

        Returns:
            the step, whose ``rewards`` are zero yet.
        """
        self.is_meta_turn[:] = False
        self.option_steps += 1
        self.option_rewards += outcomes["reward"]
        is_illegal = (actions < 0) | (actions >= n_actions)
        self.illegal_actions += is_illegal
        self.previous_actions = np.where(is_illegal, n_actions, actions)
        goals, events = self.goals.copy(), outcomes["event"].astype(np.int64)
        self.first_events = np.where(self.first_events == NO_GOAL, events, self.first_events)
        terminated, truncated = outcomes["terminated"].copy(), outcomes["truncated"].copy()
        episode_ended = terminated | truncated
        reached = goal_reached(outcomes, goals)
        timed_out = (self.option_steps >= subgoal_horizon) & ~(reached | episode_ended)
        option_ended = reached | timed_out | episode_ended
        return_terminated = terminated | reached if return_ends_with_option else terminated
        return_truncated = truncated | timed_out if return_ends_with_option else truncated
        step = Step(
            actions=self.previous_actions.copy(),
            goals=goals,
            events=events,
            is_first=outcomes["is_first"].copy(),
            is_discovery=outcomes["is_discovery"].copy(),
            is_novel=outcomes["is_novel"].copy(),
            rewards=np.zeros(len(actions)),
            extrinsic=outcomes["reward"].copy(),
            reached=reached,
            timed_out=timed_out,
            option_ended=option_ended,
            meta_rewards=np.where(option_ended, self.option_rewards, 0.0),
            meta_elapsed=self.option_steps.copy(),
            achieved_instead=np.where(option_ended & ~reached, self.first_events, NO_GOAL),
            terminated=terminated,
            truncated=truncated,
            return_terminated=return_terminated,
            return_truncated=return_truncated & ~return_terminated,
            lengths=outcomes["length"].astype(np.int64),
            shortest=self.shortest.copy(),
            illegal_actions=self.illegal_actions.copy(),
            before=before,
            after=after,
        )
        ended = np.flatnonzero(option_ended)
        if len(ended):
            self.last_goals[ended], self.last_outcomes[ended] = goals[ended], step.outcomes[ended]
            self.is_meta_turn[ended], self.goals[ended], self.first_events[ended] = True, NO_GOAL, NO_GOAL
            self.option_steps[ended], self.option_rewards[ended] = 0, 0.0
        return step


def reset_values(n_actions: int) -> dict[str, Any]:
    """The entries of a `Ledger` where an episode begins, by name."""
    return {
        "is_meta_turn": True,
        "goals": NO_GOAL,
        "last_goals": NO_GOAL,
        "last_outcomes": NO_OUTCOME,
        "first_events": NO_GOAL,
        "meta_turns": 0,
        "option_steps": 0,
        "option_rewards": 0.0,
        "previous_actions": n_actions,
        "illegal_goals": 0,
        "illegal_actions": 0,
        "shortest": -1,
    }
