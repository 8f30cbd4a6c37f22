"""Meta-controllers: who picks the controller's goals. The protocol, those that ship, and how a user's own is found."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import entry_points
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from hierroom.errors import InputError
from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS, N_GOALS, NO_GOAL, GoalGraph, open_goals
from hierroom.world import kernels
from hierroom.world.layout import OUTCOME, State
from hierroom.world.oracle import shortest_actions

NO_OUTCOME, REACHED, TIMED_OUT, OTHER = range(4)
"""How the last goal's life ended: there was none; reached; its horizon ran out; another event ended 'no goal'."""

ENTRY_POINT_GROUP = "hierroom.meta_controllers"
_BRANCHES = np.arange(N_COLOURS)


@dataclass(frozen=True)
class Situation:
    """What a meta-controller may know of the rooms whose turn it is.

    Args:
        indices: [M] int, the rooms' places in the batch, for meta-controllers that remember.
        state: the rooms' exact state, copied (M rooms).
        last_goals: [M] int, the last goal id, or -1.
        last_outcomes: [M] int, how it ended: ``NO_OUTCOME``, ``REACHED``, ``TIMED_OUT`` or ``OTHER``.
        draws: [M, 13] float in [0, 1), random numbers for this turn, one for each goal id. They are fixed by seed,
            room, episode and turn, so a choice made with them is the same in whatever batch it is made.
    """

    indices: NDArray[np.integer]
    state: State
    last_goals: NDArray[np.integer]
    last_outcomes: NDArray[np.integer]
    draws: NDArray[np.float64]

    @cached_property
    def exists(self) -> NDArray[np.bool_]:
        """[M, 6] whether branch room 1, 2, ... is there."""
        return self.state.rooms["n_rooms"][:, None] - 1 > _BRANCHES

    @cached_property
    def keys(self) -> NDArray[np.bool_]:
        """[M, 6] whether the key of branch room 1, 2, ... is held."""
        return (self.state.rooms["keys"][:, None] >> _BRANCHES & 1).astype(bool)

    @cached_property
    def doors(self) -> NDArray[np.bool_]:
        """[M, 6] whether the door of branch room 1, 2, ... is open."""
        return (self.state.rooms["doors"][:, None] >> _BRANCHES & 1).astype(bool)

    @property
    def colours(self) -> NDArray[np.integer]:
        """[M, 6] colour of branch room 1, 2, ...: the key's goal id; the door's is 6 more."""
        return self.state.rooms["colours"]

    @property
    def key_rooms(self) -> NDArray[np.integer]:
        """[M, 6] room in which the key of branch room 1, 2, ... lies."""
        return self.state.rooms["key_rooms"]

    def graph(self, m: int) -> GoalGraph:
        """The goal graph of the m-th room."""
        room = self.state.rooms[m]
        return GoalGraph(tuple(room.key_rooms[: room.n_rooms - 1].tolist()), int(room.exit_room))

    def by_goal(self, keys: NDArray, doors: NDArray, exits: NDArray) -> NDArray:
        """Values per branch room [M, 6], [M, 6] and per room [M] as values per goal id [M, 13]."""
        values = np.empty((len(self.indices), N_GOALS), keys.dtype)
        np.put_along_axis(values, self.colours, keys, axis=1)
        np.put_along_axis(values, self.colours + FIRST_DOOR_GOAL, doors, axis=1)
        values[:, EXIT_GOAL] = exits
        return values


def reachable_goals(situation: Situation) -> NDArray[np.bool_]:
    """[M, 13] goals that can be achieved before anything else is."""
    can = open_goals(situation.key_rooms, situation.state.rooms["exit_room"], situation.keys, situation.doors)
    exists = situation.exists
    return situation.by_goal(can[:, :N_COLOURS] & exists, can[:, N_COLOURS:-1] & exists, can[:, -1])


def existing_goals(situation: Situation) -> NDArray[np.bool_]:
    """[M, 13] goals of the level that are not achieved yet."""
    closed = situation.exists & ~situation.doors
    return situation.by_goal(closed & ~situation.keys, closed, np.ones(len(closed), bool))


def seen_goals(situation: Situation) -> NDArray[np.bool_]:
    """[M, 13] goals that came into view this episode and are not achieved yet."""
    seen = situation.state.rooms["seen"][:, None] >> np.arange(N_GOALS) & 1
    return existing_goals(situation) & seen.astype(bool)


def all_goals(situation: Situation) -> NDArray[np.bool_]:
    """[M, 13] every goal id, whether it exists or not."""
    return np.ones((len(situation.indices), N_GOALS), bool)


GOAL_MASKS: Mapping[str, Callable[[Situation], NDArray[np.bool_]]] = {
    "reachable": reachable_goals,
    "existing": existing_goals,
    "seen": seen_goals,
    "none": all_goals,
}
"""Which goals a meta-controller may choose; where a mask leaves none, 'no goal' is the one legal choice."""


@runtime_checkable
class MetaController(Protocol):
    """Chooses goals. Any class with `choose` will do; `reset` is called where it exists."""

    def choose(
        self, observations: Mapping[str, NDArray], legal: NDArray[np.bool_], situation: Situation
    ) -> NDArray[np.integer]:
        """Choose a goal for each of the M rooms whose turn it is.

        Args:
            observations: the observations of ``meta_0`` in the AEC environment, batched: ``observation``
                [M, 7, 7, 3] uint8, ``goal`` [M, 9] (the last one), ``action_mask`` [M, 14] and the rest.
            legal: [M, 13] bool, the goals that may be chosen; a row may be empty.
            situation: everything else there is to know.

        Returns:
            [M] goal ids 0 to 12, or -1 for no goal; a goal that is not legal counts as no goal.
        """
        ...


class FixedDFS:
    """Goals along a random depth-first path over the goal graph (the meta-controller of the paper's runs).

    At random among the keys within reach, then that key's door, then deeper; the exit as soon as its room is open.
    """

    def choose(self, observations, legal, situation: Situation) -> NDArray[np.integer]:
        """The exit, else the door of a key held, else a key in the room opened last that still has one."""
        opened_at = np.pad(situation.state.rooms["opened_at"], ((0, 0), (1, 0)))  # [M, 7], the centre at step 0
        recency = np.take_along_axis(opened_at, situation.key_rooms, axis=1).astype(np.int64)  # [M, 6]
        later = recency.max(initial=0) + 1
        rank = situation.by_goal(recency, recency + later, np.full(len(recency), 2 * later))
        return np.where(legal.any(axis=1), _random_best(rank, legal, situation.draws), NO_GOAL)


class RandomGoals:
    """A legal goal at random."""

    def choose(self, observations, legal, situation: Situation) -> NDArray[np.integer]:
        """Each legal goal with the same probability."""
        return np.where(legal.any(axis=1), _random_best(np.zeros(legal.shape), legal, situation.draws), NO_GOAL)


class OracleGoals:
    """The next goal on a shortest way to the exit."""

    def choose(self, observations, legal, situation: Situation) -> NDArray[np.integer]:
        """The first goal event of the shortest action sequence, whether or not the mask allows it."""
        return np.array([_first_event(situation.state[m]) for m in range(len(situation.indices))])


class NoGoals:
    """Never a goal: the flat methods."""

    def choose(self, observations, legal, situation: Situation) -> NDArray[np.integer]:
        """No goal in any room."""
        return np.full(len(situation.indices), NO_GOAL)


META_CONTROLLERS: Mapping[str, type] = {
    "fixed-dfs": FixedDFS,
    "random": RandomGoals,
    "oracle": OracleGoals,
    "none": NoGoals,
}
"""The meta-controllers that ship, by the name users type."""


def make_meta(spec: str | MetaController) -> MetaController:
    """The meta-controller a user means.

    Args:
        spec: a name in `META_CONTROLLERS`; the name of an entry point in the group ``hierroom.meta_controllers``;
            ``package.module:Class``, looked for in the current folder too; or a meta-controller itself.

    Raises:
        InputError: if there is no such meta-controller, or it has no method ``choose``.
    """
    if not isinstance(spec, str):
        return _checked(spec, repr(spec))
    if spec in META_CONTROLLERS:
        return META_CONTROLLERS[spec]()
    for entry_point in entry_points(group=ENTRY_POINT_GROUP, name=spec):
        return _checked(entry_point.load()(), spec)
    if ":" not in spec:
        raise InputError(
            f"a meta-controller is one of {', '.join(META_CONTROLLERS)}, an entry point of {ENTRY_POINT_GROUP} "
            f"or package.module:Class, not {spec!r}"
        )
    return _checked(_load(spec)(), spec)


def _load(spec: str) -> type:
    module, _, name = spec.partition(":")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        return getattr(importlib.import_module(module), name)
    except ModuleNotFoundError as error:
        raise InputError(f"there is no module {error.name!r} for the meta-controller {spec!r}") from error
    except AttributeError as error:
        raise InputError(f"the module {module!r} has no {name!r} (meta-controller {spec!r})") from error


def _checked(meta, name: str) -> MetaController:
    if not callable(getattr(meta, "choose", None)):
        raise InputError(f"a meta-controller has a method choose(observations, legal, situation); {name} has none")
    return meta


def _random_best(rank: NDArray, legal: NDArray[np.bool_], draws: NDArray[np.float64]) -> NDArray[np.integer]:
    """[M] the legal goal of highest whole-numbered rank, ties broken by the draws."""
    return np.where(legal, rank + draws, -1).argmax(axis=1)


def _first_event(state: State) -> int:
    outcomes = np.zeros(1, OUTCOME)
    for action in shortest_actions(state):
        kernels.step_rooms(state.rooms, state.grids, np.array([action], np.int64), outcomes)
        if outcomes["event"][0] >= 0:
            return int(outcomes["event"][0])
    return NO_GOAL
