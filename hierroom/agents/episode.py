"""Recorded episodes: subgoals, actions, rewards, ends and all states."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import GoalGraph
from hierroom.support.errors import warn_once
from hierroom.turns.kernels import NO_OUTCOME, OTHER, REACHED, TIMED_OUT
from hierroom.worlds.world import Replayer

OUTCOME_NAMES = {REACHED: "reached", TIMED_OUT: "timed out", OTHER: "episode ended"}


@dataclass(frozen=True)
class Subgoal:
    """A goal that the meta-controller chose, and the option that pursued it.

    Args:
        goal: goal id, -1 for no goal.
        name: the goal in words, such as ``"red key 1"`` or ``"no goal"``.
        label: the same without its colour, which is drawn for each episode: ``"key 1"``.
        first_step: the first step of the option; the first step of the episode is 1.
        steps: number of steps of the option.
        outcome: how it ended: ``"reached"``, ``"timed out"`` or ``"episode ended"``.
    """

    goal: int
    name: str
    label: str
    first_step: int
    steps: int
    outcome: str


@dataclass(frozen=True)
class GoalEvent:
    """An achieved goal, whether or not it was pursued.

    Args:
        step: the step that achieved it; the first step of the episode is 1.
        goal: goal id.
        name: the goal in words, such as ``"red key 1"``.
        label: the same without its colour: ``"key 1"``.
    """

    step: int
    goal: int
    name: str
    label: str


@dataclass(frozen=True, eq=False)
class Episode:
    """An episode of L primitive steps.

    It can be pickled. A pickled episode of a `Task` is without the task's functions: its `states` raises an
    `InputError`, and all else works.

    Args:
        start: the environment's state before the first step, from `BaseWorld.get_state`.
        replayer: replays the episode.
        graph: the goal graph of the level; for a task its rules, or None.
        variant: the name of the goal graph or of the task.
        actions: [L] int, the controller's actions; the number of actions in place of one that does not exist. Or
            [L, ...], if they are arrays.
        rewards: [L] float64, the controller's rewards.
        extrinsic: [L] float64, the environment's own rewards.
        goals: [L] int, the goal ids pursued in each step, or -1.
        achieved: [L] int, the goal id that each step achieved, or -1; of several, the one in `Step.events`.
        outcomes: [L] int, how the option ended if the step ended one (``REACHED``, ``TIMED_OUT`` or ``OTHER``), else
            ``NO_OUTCOME``.
        terminated: whether the world ended it, because the target was reached or can no longer be reached.
        truncated: whether it was cut off, usually by the step limit.
        success: whether it reached its target; None without a target.
        shortest: the shortest possible length, or -1 if it was not measured.
        observations: the controller's observations before each step and after the last one, by entry name, as arrays
            [L + 1, ...]; None unless requested.

    Examples:
        >>> episode = next(hierroom.rollout("oracle", hierroom.EnvConfig("a"), episodes=1))
        >>> episode.success, [event.label for event in episode.events]
        (True, ['key 1', 'door 1', 'exit'])
    """

    start: Any
    replayer: Replayer
    graph: Any
    variant: str
    actions: NDArray
    rewards: NDArray[np.float64]
    extrinsic: NDArray[np.float64]
    goals: NDArray[np.integer]
    achieved: NDArray[np.integer]
    outcomes: NDArray[np.integer]
    terminated: bool
    truncated: bool
    success: bool | None
    shortest: int
    observations: Mapping[str, NDArray] | None = None

    def __len__(self) -> int:
        return len(self.actions)

    def __repr__(self) -> str:
        return f"<Episode {self.title}>"

    @property
    def title(self) -> str:
        """Return a one-line description of the episode."""
        what = "graph" if isinstance(self.graph, GoalGraph) else "task"
        where = f"{what} {self.variant}, seed {self.seed}, environment {self.env}, episode {self.number}"
        shortest = f" (shortest {self.shortest})" if self.shortest >= 0 else ""
        return f"{where}: {self.end}, {len(self)} steps{shortest}"

    @property
    def end(self) -> str:
        """Return in words whether it reached its target, or without one its return."""
        if self.success is None:
            return f"return {self.rewards.sum():.5g}"
        if isinstance(self.graph, GoalGraph):
            return "escaped" if self.success else "did not escape"
        return "reached its target" if self.success else "did not reach its target"

    @property
    def seed(self) -> int:
        """The seed of the environments; with `env` and `number` it determines the level."""
        return self.replayer.identity(self.start)[0]

    @property
    def env(self) -> int:
        """The index of the environment."""
        return self.replayer.identity(self.start)[1]

    @property
    def number(self) -> int:
        """Return the number of episodes that the environment began before this one with that seed."""
        return self.replayer.identity(self.start)[2]

    @property
    def subgoals(self) -> tuple[Subgoal, ...]:
        """Return the goals that the meta-controller chose, option by option."""
        subgoals, first = [], 0
        for last in np.flatnonzero(self.outcomes != NO_OUTCOME).tolist():
            goal, outcome = int(self.goals[last]), OUTCOME_NAMES[int(self.outcomes[last])]
            subgoals.append(Subgoal(goal, *self._names_of(goal), first + 1, last + 1 - first, outcome))
            first = last + 1
        return tuple(subgoals)

    @property
    def events(self) -> tuple[GoalEvent, ...]:
        """The achieved goals in order."""
        steps = np.flatnonzero(self.achieved >= 0).tolist()
        return tuple(GoalEvent(n + 1, goal := int(self.achieved[n]), *self._names_of(goal)) for n in steps)

    def _names_of(self, goal: int) -> tuple[str, str]:
        return self.name_of(goal), self.replayer.goal_label(self.start, goal)

    def name_of(self, goal: int) -> str:
        """Return the name of a goal in this episode."""
        return self.replayer.goal_name(self.start, int(goal))

    def action_name(self, step: int) -> str:
        """Return the name of the action of a step, counted from 1."""
        return self.replayer.action_name(self.start, self.actions[step - 1])

    def states(self, drawn: Container[int] | None = None) -> Iterator[Any]:
        """Replay the episode: yield the L + 1 states before, between and after its steps.

        ``drawn`` has the numbers of the states that a replayer's ``picture`` will draw, as drawing a `Task` may be
        slow; None: all. A warning says if a `Task` achieves other goals in its replay, because its seed does not
        determine it, or because drawing changes it.
        """
        state_of, before, is_same = getattr(self.replayer, "rules_state", None), None, True
        for step, state in enumerate(self.replayer.replay(self.start, self.actions, drawn)):
            if state_of is not None:
                now, goal = state_of(state)[0], self.achieved[step - 1] if step else -1
                is_same &= bool(now[goal] if goal >= 0 else before is None or (now == before).all())
                before = now
            yield state
        if not is_same:
            warn_once(
                f"a replay of {self.variant} achieves other goals than the episode: its seed does not determine it"
            )

    def to_dict(self) -> dict[str, Any]:
        """Return the episode as plain types by name, for JSON."""
        return {
            "seed": self.seed,
            "env": self.env,
            "episode": self.number,
            "graph": self.variant,
            "success": self.success,
            "terminated": self.terminated,
            "truncated": self.truncated,
            "length": len(self),
            "shortest": self.shortest if self.shortest >= 0 else None,
            "return": float(self.rewards.sum()),
            "extrinsic_return": float(self.extrinsic.sum()),
            "subgoals": [vars(subgoal).copy() for subgoal in self.subgoals],
            "events": [vars(event).copy() for event in self.events],
            "actions": [self.action_name(step) for step in range(1, len(self) + 1)],
            "rewards": self.rewards.tolist(),
            "extrinsic": self.extrinsic.tolist(),
        }
