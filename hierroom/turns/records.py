"""Records of the turns: their state in each environment, and the results of one primitive step.

Compiled kernels read and write the records; the classes give their fields as arrays.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import InputError
from hierroom.support.schema import Table, of_records, record_type
from hierroom.turns.kernels import NO_GOAL, NO_OUTCOME, OTHER, REACHED, TIMED_OUT

META, CONTROLLER = "meta_0", "controller_0"
AGENTS = (META, CONTROLLER)
"""The agents in the order in which they act."""
N_OUTCOMES = len((NO_OUTCOME, REACHED, TIMED_OUT, OTHER))
_MOST = 2**62


LEDGER = record_type(
    ("is_meta_turn", "?"),  # the meta-controller acts next
    ("goals", "i8"),  # the goal pursued, or -1
    ("last_goals", "i8"),  # the goal pursued before, or -1
    ("last_outcomes", "i8"),  # how that option ended: NO_OUTCOME, REACHED, TIMED_OUT or OTHER
    ("first_events", "i8"),  # the goal achieved first in the current option, or -1
    ("meta_turns", "i8"),  # turns that the meta-controller took this episode
    ("option_steps", "i8"),  # primitive steps since the meta-controller's last turn
    ("option_rewards", "f8"),  # extrinsic reward since then
    ("previous_actions", "i8"),  # the controller's last action; the number of actions if there is none or if illegal
    ("illegal_goals", "i8"),  # illegal actions of the meta-controller this episode
    ("illegal_actions", "i8"),  # illegal actions of the controller this episode
    ("shortest", "i8"),  # the shortest possible length of the episode, or -1 if it is not measured
)
"""State of the turns in one environment."""

REWARDED = ("extrinsic", "n_first", "reached", "is_novel")
"""Fields of a step of which built-in rewards are made."""

RULES = record_type(
    ("return_ends_with_option", "?"),  # the controller's return ends with its option
    ("horizon", "i8"),  # steps after which an option ends without its goal
    ("n_actions", "i8"),  # the controller's number of actions
    *((name, "f8") for name in REWARDED),  # their weights in the controller's reward
    ("autoreset", "?"),  # the next episode begins where one ended; if False, the meta-controller has no turn there
    ("target", "i8"),  # the target goal, or `NO_TARGET`: an episode that terminates by achieving it is a success
)
"""Rules of the turns, the same in all environments."""

STEP = record_type(
    ("actions", "i8"),
    ("goals", "i8"),
    ("events", "i8"),
    ("achieved_bits", "i8"),
    ("n_first", "i8"),
    ("elapsed", "i8"),
    ("meta_elapsed", "i8"),
    ("achieved_instead", "i8"),
    ("lengths", "i8"),
    ("shortest", "i8"),
    ("illegal_actions", "i8"),
    ("rewards", "f8"),
    ("extrinsic", "f8"),
    ("meta_rewards", "f8"),
    ("is_discovery", "?"),
    ("is_novel", "?"),
    ("reached", "?"),
    ("timed_out", "?"),
    ("option_ended", "?"),
    ("terminated", "?"),
    ("truncated", "?"),
    ("success", "?"),
    ("episode_ended", "?"),
    ("return_terminated", "?"),
    ("return_truncated", "?"),
)
"""Record of a step in one environment: see the attributes of `Step`."""
_STEP_NAMES = frozenset(STEP.names or ())
REPORTED = (
    *("events", "elapsed", "meta_elapsed", "lengths", "shortest", "rewards", "extrinsic"),
    *("terminated", "truncated", "episode_ended", "goals", "success"),
)
"""The fields of a step that single environments report to users."""
_REPORTED = STEP[list(REPORTED)]


def ledger_schema(num_envs: int, n_goals: int, n_actions: int) -> Table:
    """Return the bounds of the fields of a ledger of N environments."""
    return of_records(
        LEDGER,
        num_envs,
        {
            **dict.fromkeys(("goals", "last_goals", "first_events"), (NO_GOAL, n_goals - 1)),
            "last_outcomes": (NO_OUTCOME, OTHER),
            **dict.fromkeys(("meta_turns", "option_steps", "illegal_goals", "illegal_actions"), (0, _MOST)),
            "previous_actions": (0, n_actions),
            "shortest": (-1, _MOST),
        },
    )


def ledger_at_reset(n_actions: int) -> np.ndarray:
    """Return the ledger record [1] of an environment at the start of an episode."""
    start = np.zeros(1, LEDGER)
    start["is_meta_turn"], start["last_outcomes"], start["previous_actions"] = True, NO_OUTCOME, n_actions
    for name in ("goals", "last_goals", "first_events"):
        start[name] = NO_GOAL
    start["shortest"] = -1
    return start


class Step:
    """The results of one primitive step in N environments, in read-only arrays of its own.

    Args:
        records: [N] records of `STEP`.
        n_goals: number of goals G.
        before: the state before the step, if the controller's reward needs states and the world has them.
        after: the state after the step and before any reset; None if ``before`` is None.
        lacks_visits: whether ``is_novel`` raises an error, for a reward that did not ask for the memory ``visited``.
        taken: the actions [N, ...] if they are arrays.

    Attributes:
        actions: [N] int, the controller's actions; the number of actions in place of one that does not exist. If they
            are arrays: [N, ...], as they were given, but clipped to their bounds.
        goals: [N] int, the goals pursued, or -1.
        events: [N] int, the goal achieved, or -1; of several, the pursued one, else the one with the lowest id.
        achieved: [N, G] bool, all goals achieved.
        n_first: [N] int, how many of them were achieved for the first time this episode.
        is_first: [N] bool, whether ``n_first`` is above 0.
        is_discovery: [N] bool, something relevant came into view for the first time this episode.
        is_novel: [N] bool, the agent was not here before since its last new achievement. False if the world does not
            remember ``visited``; an error for a reward that does not ask for that memory.
        rewards: [N] float64, the controller's rewards.
        extrinsic: [N] float64, the environment's own rewards.
        reached: [N] bool, the goal was reached.
        timed_out: [N] bool, the option's horizon ran out before its goal was reached or the episode ended.
        option_ended: [N] bool, the option ended for any reason, and with it the meta-controller's turn.
        outcomes: [N] int, how an option ended, where one did: ``REACHED``, ``TIMED_OUT`` or ``OTHER``.
        meta_rewards: [N] float64, the extrinsic reward summed over the option where it ended, else 0.
        elapsed: [N] int, primitive steps of the controller's action: 1, unless the environment reports others.
        meta_elapsed: [N] int, primitive steps since the meta-controller's last turn, this one included.
        achieved_instead: [N] int, the first goal achieved in an option that ended without its own goal, else -1.
        terminated: [N] bool, the world ended the episode: the target was reached or can no longer be reached.
        truncated: [N] bool, the episode was cut off, usually by the step limit.
        success: [N] bool, the target was reached; False without a target.
        episode_ended: [N] bool, the episode terminated or was truncated.
        return_terminated: [N] bool, the controller's return ends here, with no later rewards.
        return_truncated: [N] bool, the controller's return is cut off here although it would continue.
        lengths: [N] int, steps of the episode so far.
        shortest: [N] int, the shortest possible length of the episode, or -1 if it is not measured.
        illegal_actions: [N] int, controller actions so far this episode that do not exist.
    """

    __slots__ = ("_lacks_visits", "after", "before", "n_goals", "records", "reported", "taken")

    def __init__(
        self,
        records: np.ndarray,
        n_goals: int,
        before: Any = None,
        after: Any = None,
        *,
        lacks_visits: bool = False,
        taken: NDArray | None = None,
    ) -> None:
        self.records, self.n_goals, self.before, self.after = records, n_goals, before, after
        self._lacks_visits, self.taken = lacks_visits, taken
        self.reported = records.view(_REPORTED)

    def __getattr__(self, name: str) -> Any:
        """Return a field by its name; fields are looked up only when read, because most never are."""
        if name in _STEP_NAMES:
            if name == "is_novel" and self._lacks_visits:
                raise InputError('a reward that reads is_novel must have the attribute memories = ("visited",)')
            if name == "actions" and self.taken is not None:
                return self.taken
            return self.records[name]
        raise AttributeError(f"a step has no {name!r}")

    @property
    def achieved(self) -> NDArray[np.bool_]:
        """Goals that the step achieved, [N, G] bool."""
        return (self.records["achieved_bits"][:, None] >> np.arange(self.n_goals) & 1).astype(bool)

    @property
    def is_first(self) -> NDArray[np.bool_]:
        """Flags [N] whether a goal was achieved for the first time this episode."""
        return self.records["n_first"] > 0

    @property
    def outcomes(self) -> NDArray[np.integer]:
        """Outcomes [N] of options that ended: ``REACHED``, ``TIMED_OUT`` or ``OTHER``."""
        return np.where(self.reached, REACHED, np.where(self.timed_out, TIMED_OUT, OTHER))

    def ended_turns(self, agent: str) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray]:
        """Return an agent's turns that the step ended: every controller turn, or the meta-controller's ended options.

        Returns:
            Arrays [M]: the environments, the rewards of the turns (float64), their primitive steps, whether the agent's
            return ends here, and whether it is cut off here although it would continue.
        """
        if agent == CONTROLLER:
            envs, records = np.arange(len(self.records)), self.records
            ends = records["return_terminated"], records["return_truncated"]
            return envs, records["rewards"], records["elapsed"], *ends
        envs = np.flatnonzero(self.records["option_ended"])
        records = self.records.take(envs)
        terminated, truncated = records["terminated"], records["truncated"] & ~records["terminated"]
        return envs, records["meta_rewards"], records["meta_elapsed"], terminated, truncated

    def without_visits(self) -> Step:
        """Return the step for a reward that may not read ``is_novel``."""
        return Step(self.records, self.n_goals, self.before, self.after, lacks_visits=True, taken=self.taken)


def clear_steps(records: np.ndarray, envs: NDArray[np.integer], n_actions: int, shortest: NDArray[np.integer]) -> None:
    """Clear the step records of environments [M], and write their shortest lengths [M]."""
    nothing = np.zeros((), STEP)
    nothing["actions"], nothing["goals"], nothing["events"], nothing["achieved_instead"] = n_actions, *[NO_GOAL] * 3
    records.put(envs, nothing)  # an assignment would copy field by field
    records["shortest"][envs] = shortest
