"""Options: when one ends, and the ledger of the two agents' turns.

``meta_0`` acts at reset and whenever its option ends: its goal is reached, its horizon has run out or the episode has
ended. ``controller_0`` acts at every other moment, one primitive step a turn.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.support.array_pool import ArrayPool
from hierroom.support.compile.kernel import compiled
from hierroom.turns.kernels import OWN_REWARD, record_turns, take_goals
from hierroom.turns.records import LEDGER, STEP, reset_values


class Ledger:
    """Where the turns in N environments stand.

    An option ends where its goal is reached, where its horizon has run out, and where the episode ends. 'No goal' asks
    for something new: it is reached where a goal is achieved, or comes into view, for the first time this episode.

    Args:
        records: [N] records of `records.LEDGER`, of which the attributes are the fields.
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
        self._record: Callable[..., int] | None = None
        for name in LEDGER.names or ():
            setattr(self, name, records[name])

    def _empty_steps(self) -> tuple[tuple[NDArray, ...], dict[str, NDArray]]:
        return (np.empty(len(self.records), STEP),), {}

    def __reduce__(self) -> tuple[type[Ledger], tuple[np.ndarray]]:
        """Copy it with the fields of its own records as arrays."""
        return Ledger, (self.records,)

    @classmethod
    def at_reset(cls, num_envs: int, n_actions: int) -> Ledger:
        """Return the ledger of N environments whose episodes begin."""
        ledger = cls(np.zeros(num_envs, LEDGER))
        ledger.write_fields(reset_values(n_actions))
        return ledger

    def write_fields(self, values: Mapping[str, Any], envs: NDArray[np.integer] | slice = slice(None)) -> None:
        """Write values by name, one for each environment or one for all of them, for some environments."""
        for name, value in values.items():
            self.records[name][envs] = value

    def begin_options(self, envs: NDArray[np.integer], goals: NDArray[np.integer]) -> None:
        """Take the meta-controller's turn in environments [M]: pursue these goals [M], -1 for none."""
        self.goals[envs] = goals
        self.meta_turns[envs] += 1
        self.is_meta_turn[envs] = False

    def take_goals(self, masks: NDArray[np.bool_], actions: NDArray[np.int64]) -> None:
        """Take the meta-controller's turn wherever it has one: see `kernels.take_goals`."""
        _compiled_take()(masks, self.records, actions)

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
            outcomes: [N] what came of them, records of the world.
            return_ends_with_option: whether no reward after an option depends on what the controller did in it.
            subgoal_horizon: steps after which an option ends without its goal.
            n_actions: the controller's number of actions.
            reward: which reward is written: see `kernels.OWN_REWARD`, for which it is zero yet.
            novelty_bonus: the reward of ``NOVELTY`` for each new state.
            autoreset: whether the next episode begins where one ended.

        Returns:
            [N] new records of `records.STEP`, and in how many environments the episode ended.
        """
        (steps,), _ = self._steps.take()
        if self._record is None:
            self._record = _compiled_record(outcomes.dtype)
        flags = return_ends_with_option, subgoal_horizon, n_actions, reward, novelty_bonus, autoreset
        return steps, self._record(outcomes, actions, self.records, steps, *flags)


@cache
def _compiled_record(outcome: np.dtype) -> Callable[..., int]:
    """Compile `kernels.record_turns` for the outcomes of a world."""
    arrays = np.zeros(1, outcome), np.zeros(1, np.int64), np.zeros(1, LEDGER), np.zeros(1, STEP)
    return compiled(record_turns, *arrays, True, 1, 1, 1, 1.0, True)


@cache
def _compiled_take() -> Callable[..., None]:
    """Compile `kernels.take_goals` for the types of a batch's arrays."""
    return compiled(take_goals, np.zeros((1, 1), bool), np.zeros(1, LEDGER), np.zeros(1, np.int64))
