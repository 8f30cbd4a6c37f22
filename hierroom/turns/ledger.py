"""The ledger of the two agents' turns: who acts next in each environment, and which goal is pursued.

``meta_0`` acts at reset and whenever its option ends: its goal is reached, its horizon has run out or the episode has
ended. ``controller_0`` acts at all other times; its turn is one primitive step.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hierroom.support.arrays import read_only
from hierroom.support.kernel import Compiled
from hierroom.turns.kernels import record_turns, take_goals
from hierroom.turns.records import LEDGER, RULES, STEP, ledger_at_reset


class Ledger:
    """The state of the turns in N environments.

    An option ends when its goal is reached, its horizon runs out or the episode ends. 'No goal' asks for something new:
    it is reached when a goal is achieved, or comes into view, for the first time in the episode.

    Args:
        written: [N] records of `records.LEDGER` that kernels write. Users see a read-only view, ``records``, and its
            fields as attributes.
        start: [1] the record at the start of an episode.
    """

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> NDArray: ...

    def __init__(self, written: np.ndarray, start: np.ndarray) -> None:
        self._written, self._fields = written, {name: written[name] for name in LEDGER.names or ()}
        self._start = start
        self._n_turns: int | None = None  # turns the meta-controller has now; None: not counted
        self.records = read_only(written)
        for name in LEDGER.names or ():
            setattr(self, name, self.records[name])

    def __reduce__(self) -> tuple[type[Ledger], tuple[np.ndarray, np.ndarray]]:
        """Copy only the records; the copy makes its own views of them."""
        return Ledger, (self._written, self._start)

    @classmethod
    def at_reset(cls, num_envs: int, n_actions: int) -> Ledger:
        """Return the ledger of N environments at the start of episodes."""
        start = ledger_at_reset(n_actions)
        return cls(np.repeat(start, num_envs), start)

    def begin_episodes(self, envs: NDArray[np.integer]) -> None:
        """Begin the episodes of environments [M]."""
        self._n_turns = None
        self._written.put(envs, self._start)  # an assignment would copy field by field

    def write_fields(self, values: Mapping[str, Any], envs: NDArray[np.integer] | slice = slice(None)) -> None:
        """Write fields of some environments by name, with one value for each environment or one for all."""
        self._n_turns = None
        for name, value in values.items():
            self._fields[name][envs] = value

    def begin_options(self, envs: NDArray[np.integer], goals: NDArray[np.integer]) -> None:
        """Take the meta-controller's turn in environments [M] with goals [M]; -1 is no goal."""
        self._n_turns = None
        self._fields["goals"][envs] = goals
        self._fields["meta_turns"][envs] += 1
        self._fields["is_meta_turn"][envs] = False

    def count_illegal_goals(self, envs: NDArray[np.integer], are_illegal: NDArray[np.bool_]) -> None:
        """Count the illegal choices, marked in [M], of meta-controllers in environments [M]."""
        self._fields["illegal_goals"][envs] += are_illegal

    def is_any_turn(self) -> bool:
        """Return whether the meta-controller has a turn in any environment."""
        if self._n_turns is None:
            self._n_turns = int(np.count_nonzero(self.is_meta_turn))
        return self._n_turns > 0

    def record(self, outcomes: np.ndarray, actions: NDArray[np.int64], steps: np.ndarray, rules: np.ndarray) -> int:
        """Take the controller's turn; return how many episodes it ended: see `kernels.record_turns`."""
        n_ended, self._n_turns = _record(outcomes.dtype).run(
            outcomes, actions, self._written, steps, self._start, rules
        )
        return n_ended

    def take_goals(self, masks: NDArray[np.bool_], actions: NDArray[np.int64]) -> None:
        """Take the meta-controller's turn wherever it has one: see `kernels.take_goals`."""
        _TAKE.run(masks, self._written, actions)
        self._n_turns = 0


_TAKE = Compiled(take_goals, np.zeros((1, 1), bool), np.zeros(1, LEDGER), np.zeros(1, np.int64))


@cache
def _record(outcome: np.dtype) -> Compiled:
    """Return `kernels.record_turns` for the outcomes of a world."""
    ledger, rules = np.zeros(1, LEDGER), np.zeros(1, RULES)
    return Compiled(record_turns, np.zeros(1, outcome), np.zeros(1, np.int64), ledger, np.zeros(1, STEP), ledger, rules)
