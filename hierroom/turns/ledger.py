"""Options: when one ends, and the ledger of the two agents' turns.

``meta_0`` acts at reset and whenever its option ends: its goal is reached, its horizon has run out or the episode has
ended. ``controller_0`` acts at every other moment, one primitive step a turn.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.controller import Observation
from hierroom.goals import N_GOALS, NO_GOAL
from hierroom.support.array_pool import ArrayPool
from hierroom.support.compile.kernel import compiled
from hierroom.support.schema import Table, of_records
from hierroom.turns.kernels import NO_OUTCOME, OTHER, OWN_REWARD, choose_goals, record_turns
from hierroom.turns.records import STEP, Step
from hierroom.worlds.escape_room.layout import LEVEL, OUTCOME

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
    """The turns that a primitive step ended: the controller's everywhere, the meta-controller's where an option ended.

    Args:
        step: the primitive step.
        last_observation: from an agent and some environments to what it observed last in the turns that ended there.
    """
    options, (envs, ones, no_goals) = np.flatnonzero(step.option_ended), _everywhere(len(step.records))
    of_options = step.records[options]
    return {
        META: Transition(
            step,
            options,
            of_options["goals"],
            of_options["meta_rewards"],
            of_options["meta_elapsed"],
            of_options["terminated"],
            of_options["truncated"] & ~of_options["terminated"],
            of_options["episode_ended"],
            of_options["achieved_instead"],
            lambda rows: last_observation(META, options[rows]),
        ),
        CONTROLLER: Transition(
            step,
            envs,
            step.goals,
            step.rewards,
            ones,
            step.return_terminated,
            step.return_truncated,
            step.episode_ended,
            no_goals,
            lambda rows: last_observation(CONTROLLER, envs[rows]),
        ),
    }


@cache
def _everywhere(num_envs: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """[N] read-only arrays of what is the same at every step: the environments, ones, and no goals."""
    arrays = np.arange(num_envs), np.ones(num_envs, np.int64), np.full(num_envs, NO_GOAL)
    for array in arrays:
        array.setflags(write=False)
    return arrays


LEDGER = np.dtype(
    (
        np.record,
        np.dtype(
            [
                ("is_meta_turn", "?"),
                *((name, "i8") for name in ("goals", "last_goals", "last_outcomes", "first_events")),
                *((name, "i8") for name in ("meta_turns", "option_steps")),
                ("option_rewards", "f8"),
                *((name, "i8") for name in ("previous_actions", "illegal_goals", "illegal_actions", "shortest")),
            ],
            align=True,
        ),
    )
)
"""Where the turns in one environment stand, in the form that kernels read."""
LEDGER_NAMES: tuple[str, ...] = LEDGER.names or ()
_BOUNDS = {
    **dict.fromkeys(("goals", "last_goals", "first_events"), (NO_GOAL, N_GOALS - 1)),
    "last_outcomes": (NO_OUTCOME, OTHER),
    **dict.fromkeys(("meta_turns", "option_steps", "illegal_goals", "illegal_actions"), (0, 2**62)),
    "shortest": (-1, 2**62),
}
"""The smallest and the largest value of each field; that of the actions depends on how many there are."""


class Ledger:
    """Where the turns in N environments stand.

    An option ends where its goal is reached, where its horizon has run out, and where the episode ends. 'No goal' asks
    for something new: it is reached where a key, door or exit is achieved, or comes into view, for the first time this
    episode.

    Args:
        records: [N] records of `LEDGER`, of which the attributes are the fields.

    Attributes:
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

    def __init__(self, records: np.ndarray) -> None:
        self.records = records
        self._steps = ArrayPool(self._empty_steps)
        for name in LEDGER_NAMES:
            setattr(self, name, records[name])

    def _empty_steps(self) -> tuple[tuple[NDArray, ...], dict[str, NDArray]]:
        return (np.empty(len(self.records), STEP),), {}

    def __reduce__(self) -> tuple[type[Ledger], tuple[np.ndarray]]:
        """A copy, in which the arrays are the fields of its own records."""
        return Ledger, (self.records,)

    @classmethod
    def at_reset(cls, num_envs: int, n_actions: int) -> Ledger:
        """The ledger of N environments whose episodes begin; the controller has ``n_actions`` actions."""
        ledger = cls(np.zeros(num_envs, LEDGER))
        ledger.put(reset_values(n_actions))
        return ledger

    def put(self, values: Mapping[str, Any], envs: NDArray[np.integer] | slice = slice(None)) -> None:
        """Put values by name, one for each environment or one for all of them, into some environments."""
        for name, value in values.items():
            self.records[name][envs] = value

    def get_state(self) -> dict[str, NDArray]:
        """The values by name, as fresh arrays."""
        return {name: self.records[name].copy() for name in LEDGER_NAMES}

    def schema(self, n_actions: int) -> Table:
        """What the values that `put` restores may be, by name; the controller has ``n_actions`` actions."""
        return of_records(LEDGER, len(self.records), {**_BOUNDS, "previous_actions": (0, n_actions)})

    def begin_options(self, envs: NDArray[np.integer], goals: NDArray[np.integer]) -> None:
        """Take the meta-controller's turn in some environments [M]: pursue these goals [M], -1 for none."""
        self.goals[envs] = goals
        self.meta_turns[envs] += 1
        self.is_meta_turn[envs] = False

    def choose(self, levels: np.ndarray, mask: int, actions: NDArray[np.int64]) -> None:
        """Take the meta-controller's turn wherever it has one.

        Args:
            levels: [N] records of `layout.LEVEL`.
            mask: the ``kind`` of the goal mask.
            actions: [N] goal ids, or no goal (13 or -1); one that is not legal counts as no goal, and is counted.
        """
        _compiled_choose()(levels, self.records, mask, actions)

    def record(
        self,
        actions: NDArray[np.int64],
        outcomes: NDArray,
        *,
        return_ends_with_option: bool,
        subgoal_horizon: int,
        n_actions: int,
        reward: int = OWN_REWARD,
        novelty_bonus: float = 0.0,
        autoreset: bool = False,
    ) -> tuple[NDArray, int]:
        """Take the controller's turn in every environment, and end the options that it ends.

        Args:
            actions: [N] its actions.
            outcomes: [N] records of `layout.OUTCOME`: what came of them.
            return_ends_with_option: whether no reward after an option depends on what the controller did in it.
            subgoal_horizon: steps after which an option ends without its goal.
            n_actions: the controller's number of actions.
            reward: which reward is written: see `turn_kernels.OWN_REWARD`, for which it is zero yet.
            novelty_bonus: the reward of ``NOVELTY`` for each new state.
            autoreset: whether the next episode begins where one ended.

        Returns:
            [N] new records of `step.STEP`, and in how many environments the episode ended.
        """
        (steps,), _ = self._steps.take()
        n_ended = _compiled_record()(
            outcomes,
            actions,
            self.records,
            steps,
            return_ends_with_option,
            subgoal_horizon,
            n_actions,
            reward,
            novelty_bonus,
            autoreset,
        )
        return steps, n_ended


@cache
def _compiled_record() -> Callable[..., int]:
    """Compile `turn_kernels.record_turns` for the types of a batch's arrays."""
    arrays = np.zeros(1, OUTCOME), np.zeros(1, np.int64), np.zeros(1, LEDGER), np.zeros(1, STEP)
    return compiled(record_turns, *arrays, True, 1, 1, 1, 1.0, True)


@cache
def _compiled_choose() -> Callable[..., None]:
    """Compile `turn_kernels.choose_goals`, likewise."""
    return compiled(choose_goals, np.zeros(1, LEVEL), np.zeros(1, LEDGER), 1, np.zeros(1, np.int64))


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
