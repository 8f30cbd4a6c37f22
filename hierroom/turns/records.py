"""What one primitive step did, in N environments at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import InputError
from hierroom.turns.kernels import NO_GOAL, NO_OUTCOME, OTHER, REACHED, TIMED_OUT
from hierroom.worlds.escape_room.layout import State

N_OUTCOMES = len((NO_OUTCOME, REACHED, TIMED_OUT, OTHER))

STEP = np.dtype(
    (
        np.record,
        np.dtype(
            [
                *((name, "i8") for name in ("actions", "goals", "events", "meta_elapsed", "achieved_instead")),
                *((name, "i8") for name in ("lengths", "shortest", "illegal_actions")),
                *((name, "f8") for name in ("rewards", "extrinsic", "meta_rewards")),
                *((name, "?") for name in ("is_first", "is_discovery", "is_novel")),
                *((name, "?") for name in ("reached", "timed_out", "option_ended")),
                *((name, "?") for name in ("terminated", "truncated", "episode_ended")),
                *((name, "?") for name in ("return_terminated", "return_truncated")),
            ],
            align=True,
        ),
    )
)
"""What a step did in one environment, in the form that kernels write."""


class Step:
    """What one primitive step did in N environments, in arrays that nobody else holds.

    The arrays are the fields of one array of records, by which compiled code writes them.

    Args:
        records: [N] records of `STEP`.
        before: the state the step began in, where the controller's reward needs it, else None.
        after: likewise the state it led to, before any environment was reset.

    Attributes:
        actions: [N] int, the controller's actions; the number of actions where it was none of them.
        goals: [N] int, the goal ids pursued, or -1.
        events: [N] int, the goal ids achieved, or -1.
        is_first: [N] bool, it was achieved for the first time this episode.
        is_discovery: [N] bool, a key, a door or the exit came into view for the first time this episode.
        is_novel: [N] bool, the agent was not on this cell before with the same keys found and doors open; False where
            levels do not remember what was ``visited``, and an error to a reward that does not ask for that.
        rewards: [N] float64, the controller's rewards.
        extrinsic: [N] float64, the environment's own rewards.
        reached: [N] bool, the goal was reached.
        timed_out: [N] bool, the option's horizon ran out before its goal was reached or the episode ended.
        option_ended: [N] bool, the option ended for whatever reason: the meta-controller's turn ends here.
        meta_rewards: [N] float64, where the option ended the extrinsic reward summed over it, else 0.
        meta_elapsed: [N] int, primitive steps since the meta-controller's last turn, this one included.
        achieved_instead: [N] int, where an option ended without its goal the goal achieved first in it, or -1.
        terminated: [N] bool, the exit was reached.
        truncated: [N] bool, the time limit was reached.
        episode_ended: [N] bool, the episode terminated or was truncated.
        return_terminated: [N] bool, the controller's return ends here and nothing is to come.
        return_truncated: [N] bool, the controller's return is cut here, but more would have come.
        lengths: [N] int, steps of the episode so far.
        shortest: [N] int, the shortest possible length of the episode, or -1 where that is not measured.
        illegal_actions: [N] int, actions of the controller this episode that its environment does not have.
    """

    actions: NDArray[np.integer]
    goals: NDArray[np.integer]
    events: NDArray[np.integer]
    is_first: NDArray[np.bool_]
    is_discovery: NDArray[np.bool_]
    is_novel: NDArray[np.bool_]
    rewards: NDArray[np.float64]
    extrinsic: NDArray[np.float64]
    reached: NDArray[np.bool_]
    timed_out: NDArray[np.bool_]
    option_ended: NDArray[np.bool_]
    meta_rewards: NDArray[np.float64]
    meta_elapsed: NDArray[np.integer]
    achieved_instead: NDArray[np.integer]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    episode_ended: NDArray[np.bool_]
    return_terminated: NDArray[np.bool_]
    return_truncated: NDArray[np.bool_]
    lengths: NDArray[np.integer]
    shortest: NDArray[np.integer]
    illegal_actions: NDArray[np.integer]

    __slots__ = ("_lacks_visits", "after", "before", "records")

    def __init__(self, records: np.ndarray, before: State | None = None, after: State | None = None) -> None:
        self.records, self.before, self.after = records, before, after
        self._lacks_visits = False

    def __getattr__(self, name: str) -> Any:
        """An array by its name: made when it is asked for, because most are not asked for."""
        if name in _NAMES:
            if name == "is_novel" and self._lacks_visits:
                raise InputError(
                    'a reward that reads is_novel asks for what levels are to remember: memories = ("visited",), '
                    "an attribute of its class or function"
                )
            return self.records[name]
        raise AttributeError(f"a step has no {name!r}")

    @contextmanager
    def read_only(self, *, lacks_visits: bool = False) -> Iterator[None]:
        """A context for code of a user's own: what happened is not for it to change.

        Args:
            lacks_visits: whether it did not ask for what ``is_novel`` needs.
        """
        self.records.flags.writeable = False  # of every array that is asked for within
        self._lacks_visits = lacks_visits
        try:
            yield
        finally:
            self.records.flags.writeable, self._lacks_visits = True, False

    def as_dict(self) -> dict[str, NDArray]:
        """The arrays by name."""
        return {name: getattr(self, name) for name in _NAMES if name != "is_novel" or not self._lacks_visits}

    def replaced(self, **arrays: NDArray) -> Step:
        """A step in which some arrays, by name, are others; whether episodes ended follows from how they did."""
        records = self.records.copy()
        for name, array in arrays.items():
            records[name] = array
        records["episode_ended"] = records["terminated"] | records["truncated"]
        return Step(records, self.before, self.after)

    def clear(self, envs: NDArray[np.integer], n_actions: int, shortest: NDArray[np.integer]) -> None:
        """Tell that nothing was done in some environments [M], whose episodes have the shortest lengths [M]."""
        nothing = np.zeros(len(envs), STEP)
        nothing["actions"], nothing["shortest"] = n_actions, shortest
        for name in ("goals", "events", "achieved_instead"):
            nothing[name] = NO_GOAL
        self.records[envs] = nothing

    @property
    def outcomes(self) -> NDArray[np.integer]:
        """[N] int, where an option ended how it did: ``REACHED``, ``TIMED_OUT`` or ``OTHER``."""
        return np.where(self.reached, REACHED, np.where(self.timed_out, TIMED_OUT, OTHER))


_NAMES = frozenset(STEP.names or ())
