"""The records of the turns: where they stand in each environment, and what one primitive step did.

Compiled kernels read and write them; the classes give their fields as arrays by name.
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
    ("is_meta_turn", "?"),  # the meta-controller is to act next
    ("goals", "i8"),  # the goal pursued, or -1
    ("last_goals", "i8"),  # the goal pursued before, or -1
    ("last_outcomes", "i8"),  # how that option ended: NO_OUTCOME, REACHED, TIMED_OUT or OTHER
    ("first_events", "i8"),  # the goal achieved first in the option under way, or -1
    ("meta_turns", "i8"),  # turns that the meta-controller took this episode
    ("option_steps", "i8"),  # primitive steps since the meta-controller's last turn
    ("option_rewards", "f8"),  # extrinsic reward since then
    ("previous_actions", "i8"),  # the controller's last action; the number of actions before the first, or if illegal
    ("illegal_goals", "i8"),  # illegal actions of the meta-controller this episode
    ("illegal_actions", "i8"),  # illegal actions of the controller this episode
    ("shortest", "i8"),  # the shortest possible length of the episode, or -1 if it is not measured
)
"""State of the turns in one environment."""

RULES = record_type(
    ("return_ends_with_option", "?"),  # no reward after an option depends on what the controller did in it
    ("horizon", "i8"),  # steps after which an option ends without its goal
    ("n_actions", "i8"),  # the controller's number of actions
    ("reward", "i8"),  # one of `kernels.KERNEL_REWARDS`, or ``OWN_REWARD``, which writes 0
    ("bonus", "f8"),  # the size of the novelty bonus
    ("autoreset", "?"),  # the next episode begins where one ended; else the meta-controller has no turn there
    ("target", "i8"),  # the goal whose achievement makes an episode a success where it terminates
)
"""Rules of the turns, the same in all environments."""

STEP = record_type(
    ("actions", "i8"),
    ("goals", "i8"),
    ("events", "i8"),
    ("achieved_bits", "i8"),
    ("n_first", "i8"),
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
    """Return the ledger, [1] records, of an environment whose episode begins."""
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
        before: the state that the step began in, where the controller's reward needs one and the world has it.
        after: the state that it led to, before any environment was reset; None where ``before`` is.
        lacks_visits: whether it is for a reward that did not ask for what ``is_novel`` needs.

    Attributes:
        actions: [N] int, the controller's actions; the number of actions where it was none of them.
        goals: [N] int, the goals pursued, or -1.
        events: [N] int, the goal achieved, or -1; of several the one pursued, else the one of lowest number.
        achieved: [N, G] bool, all goals achieved.
        n_first: [N] int, how many of them for the first time this episode.
        is_first: [N] bool, whether any was.
        is_discovery: [N] bool, something that matters came into view for the first time this episode.
        is_novel: [N] bool, the agent was not here before since it last achieved something new. False where the world
            does not remember what was ``visited``; an error to a reward that does not ask for that.
        rewards: [N] float64, the controller's rewards.
        extrinsic: [N] float64, the environment's own rewards.
        reached: [N] bool, the goal was reached.
        timed_out: [N] bool, the option's horizon ran out before its goal was reached or the episode ended.
        option_ended: [N] bool, the option ended for whatever reason: the meta-controller's turn ends here.
        outcomes: [N] int, where an option ended how it did: ``REACHED``, ``TIMED_OUT`` or ``OTHER``.
        meta_rewards: [N] float64, where the option ended the extrinsic reward summed over it, else 0.
        meta_elapsed: [N] int, primitive steps since the meta-controller's last turn, this one included.
        achieved_instead: [N] int, where an option ended without its goal the goal achieved first in it, or -1.
        terminated: [N] bool, the world ended the episode: the target was reached, or it is out of reach for good.
        truncated: [N] bool, the time limit was reached.
        success: [N] bool, the target was reached.
        episode_ended: [N] bool, the episode terminated or was truncated.
        return_terminated: [N] bool, the controller's return ends here and nothing is to come.
        return_truncated: [N] bool, the controller's return is cut here, but more would have come.
        lengths: [N] int, steps of the episode so far.
        shortest: [N] int, the shortest possible length of the episode, or -1 where that is not measured.
        illegal_actions: [N] int, actions of the controller this episode that its environment does not have.
    """

    __slots__ = ("_lacks_visits", "after", "before", "n_goals", "records")

    def __init__(
        self, records: np.ndarray, n_goals: int, before: Any = None, after: Any = None, *, lacks_visits: bool = False
    ) -> None:
        self.records, self.n_goals, self.before, self.after = records, n_goals, before, after
        self._lacks_visits = lacks_visits

    def __getattr__(self, name: str) -> Any:
        """Return a field by its name; it is looked up when it is asked for, because most are not."""
        if name in _STEP_NAMES:
            if name == "is_novel" and self._lacks_visits:
                raise InputError(
                    'a reward that reads is_novel asks for what levels are to remember: memories = ("visited",), '
                    "an attribute of its class or function"
                )
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
        """Return the turns of an agent that the step ended: the controller's everywhere, the meta-controller's options.

        Returns:
            Arrays [M]: the environments, the rewards of the turns (float64), their primitive steps, whether the agent's
            return ends here, and whether it is cut here although more would have come.
        """
        if agent == CONTROLLER:
            envs, records = np.arange(len(self.records)), self.records
            elapsed = np.ones(len(envs), np.int64)
            return envs, records["rewards"], elapsed, records["return_terminated"], records["return_truncated"]
        envs = np.flatnonzero(self.records["option_ended"])
        records = self.records.take(envs)
        terminated, truncated = records["terminated"], records["truncated"] & ~records["terminated"]
        return envs, records["meta_rewards"], records["meta_elapsed"], terminated, truncated

    def without_visits(self) -> Step:
        """Return the step for a reward that did not ask for what ``is_novel`` needs."""
        return Step(self.records, self.n_goals, self.before, self.after, lacks_visits=True)


def clear_steps(records: np.ndarray, envs: NDArray[np.integer], n_actions: int, shortest: NDArray[np.integer]) -> None:
    """Note that nothing was done in environments [M], with shortest lengths [M]."""
    nothing = np.zeros((), STEP)
    nothing["actions"], nothing["goals"], nothing["events"], nothing["achieved_instead"] = n_actions, *[NO_GOAL] * 3
    records.put(envs, nothing)  # an assignment would copy field by field
    records["shortest"][envs] = shortest
