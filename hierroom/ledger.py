"""The rules of the two agents' turns, apart from any room: who acts, how long for, and who is owed what.

``meta_0`` acts at reset and whenever its goal's life, an *option*, is over: the goal is reached, its horizon has run
out or the episode has ended. ``controller_0`` acts at every other moment, one primitive step a turn.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.controller import Pay, goal_reached
from hierroom.goals import NO_GOAL
from hierroom.step import NO_OUTCOME, Step


@dataclass
class Ledger:
    """What the turns in N rooms stand at.

    Args:
        is_meta_turn: [N] bool, where the meta-controller is to act next.
        goals: [N] int, the goal ids pursued, or -1.
        last_goals: [N] int, the goal ids pursued before, or -1.
        last_outcomes: [N] int, how their lives ended: ``NO_OUTCOME``, ``REACHED``, ``TIMED_OUT`` or ``OTHER``.
        meta_turns: [N] int, turns the meta-controller took this episode.
        option_steps: [N] int, primitive steps since the meta-controller's last turn.
        option_rewards: [N] float64, extrinsic reward since then.
        previous_actions: [N] int, the controller's last actions, or the number of actions before the first.
        illegal_goals: [N] int, actions of the meta-controller this episode that were not legal.
        illegal_actions: [N] int, actions of the controller this episode that are none of its room's.
        shortest: [N] int, the shortest possible lengths of the episodes under way, or -1 if they are not measured.
    """

    is_meta_turn: NDArray[np.bool_]
    goals: NDArray[np.integer]
    last_goals: NDArray[np.integer]
    last_outcomes: NDArray[np.integer]
    meta_turns: NDArray[np.integer]
    option_steps: NDArray[np.integer]
    option_rewards: NDArray[np.float64]
    previous_actions: NDArray[np.integer]
    illegal_goals: NDArray[np.integer]
    illegal_actions: NDArray[np.integer]
    shortest: NDArray[np.integer]

    @classmethod
    def of_beginnings(cls, n: int, n_actions: int) -> Ledger:
        """The ledger of N rooms whose episodes begin; the controller has ``n_actions`` actions."""
        return cls(**{name: np.full(n, value) for name, value in beginning(n_actions).items()})

    def put(self, values: Mapping[str, Any], indices: NDArray[np.integer] | slice = slice(None)) -> None:
        """Put values by name, one for each room or one for all of them, into some rooms."""
        for name, value in values.items():
            getattr(self, name)[indices] = value

    def get_state(self) -> dict[str, NDArray]:
        """The values by name, as fresh arrays."""
        return {name: array.copy() for name, array in vars(self).items()}

    def begin_options(self, indices: NDArray[np.integer], goals: NDArray[np.integer]) -> None:
        """Take the meta-controller's turn in some rooms [M]: pursue these goals [M], -1 for none."""
        self.goals[indices] = goals
        self.meta_turns[indices] += 1
        self.is_meta_turn[indices] = False

    def record(
        self, actions: NDArray[np.int64], outcomes: NDArray, pay: Pay, subgoal_horizon: int, n_actions: int
    ) -> Step:
        """Take the controller's turn in every room, and end the options that it ends.

        Args:
            actions: [N] its actions.
            outcomes: [N] records of `layout.OUTCOME`: what came of them.
            pay: how the controller is paid.
            subgoal_horizon: steps after which a goal's life ends unreached.
            n_actions: the controller's number of actions.
        """
        self.is_meta_turn[:] = False
        self.option_steps += 1
        self.option_rewards += outcomes["reward"]
        self.illegal_actions += (actions < 0) | (actions >= n_actions)
        self.previous_actions[:] = actions
        goals, events = self.goals.copy(), outcomes["event"].astype(np.int64)
        terminated, truncated = outcomes["terminated"].copy(), outcomes["truncated"].copy()
        over = terminated | truncated
        reached = goal_reached(outcomes, goals)
        timed_out = (self.option_steps >= subgoal_horizon) & ~(reached | over)
        option_over = reached | timed_out | over
        step = Step(
            actions=actions.copy(),
            goals=goals,
            events=events,
            rewards=pay.rewards(outcomes, reached),
            extrinsic=outcomes["reward"].copy(),
            reached=reached,
            timed_out=timed_out,
            option_over=option_over,
            meta_rewards=np.where(option_over, self.option_rewards, 0.0),
            meta_elapsed=self.option_steps.copy(),
            terminated=terminated,
            truncated=truncated,
            lengths=outcomes["length"].astype(np.int64),
            shortest=self.shortest.copy(),
            illegal_actions=self.illegal_actions.copy(),
        )
        ended = np.flatnonzero(option_over)
        if len(ended):
            self.last_goals[ended], self.last_outcomes[ended] = goals[ended], step.outcomes[ended]
            self.is_meta_turn[ended], self.goals[ended] = True, NO_GOAL
            self.option_steps[ended], self.option_rewards[ended] = 0, 0.0
        return step


def beginning(n_actions: int) -> dict[str, Any]:
    """What a room's turns stand at when its episode begins, by name."""
    return {
        "is_meta_turn": True,
        "goals": NO_GOAL,
        "last_goals": NO_GOAL,
        "last_outcomes": NO_OUTCOME,
        "meta_turns": 0,
        "option_steps": 0,
        "option_rewards": 0.0,
        "previous_actions": n_actions,
        "illegal_goals": 0,
        "illegal_actions": 0,
        "shortest": -1,
    }
