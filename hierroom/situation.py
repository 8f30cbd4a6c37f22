"""What a meta-controller may know of the rooms whose turn it is, and which goals it may choose there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray

from hierroom.controller import Sight
from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS, N_GOALS, GoalGraph
from hierroom.world.layout import State

_BRANCHES = np.arange(N_COLOURS)


@dataclass(frozen=True)
class Situation:
    """What a meta-controller may know of the rooms whose turn it is.

    Args:
        indices: [M] int, the rooms' places in the batch, for meta-controllers that remember.
        state: the rooms' exact state, copied (M rooms).
        last_goals: [M] int, the last goal id, or -1.
        last_outcomes: [M] int, how it ended: ``NO_OUTCOME``, ``REACHED``, ``TIMED_OUT`` or ``OTHER`` of `step`.
        draws: [M, 14] float in [0, 1), random numbers for this turn, one for each goal id and one for no goal. They are
            fixed by seed, room, episode and turn: a choice made with them is the same in whatever batch it is made.
        sight: what is to be seen from the rooms, the last goals as its goals; what `inputs` are made of.
    """

    indices: NDArray[np.integer]
    state: State
    last_goals: NDArray[np.integer]
    last_outcomes: NDArray[np.integer]
    draws: NDArray[np.float64]
    sight: Sight

    def __len__(self) -> int:
        return len(self.indices)

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
        """[M, 6] room in which the key of branch room 1, 2, ... lay at the start."""
        return self.state.rooms["key_rooms"]

    @cached_property
    def reachable(self) -> NDArray[np.bool_]:
        """[M, 13] goals that can be achieved before anything else is: `GoalGraph.open_goals` by goal id."""
        goals = np.zeros((len(self), N_GOALS), bool)
        write_reachable(self.state.rooms, goals)
        return goals

    def graph(self, m: int) -> GoalGraph:
        """The goal graph of the m-th room."""
        room = self.state.rooms[m]
        return GoalGraph(tuple(room.key_rooms[: room.n_rooms - 1].tolist()), int(room.exit_room))

    def by_goal(self, keys: NDArray, doors: NDArray, exits: NDArray) -> NDArray:
        """Values per branch room [M, 6], [M, 6] and per room [M] as values per goal id [M, 13]."""
        values = np.empty((len(self), N_GOALS), keys.dtype)
        rows, colours = np.arange(len(self))[:, None], self.colours
        values[rows, colours] = keys
        values[rows, colours + FIRST_DOOR_GOAL] = doors
        values[:, EXIT_GOAL] = exits
        return values


@njit(cache=True)
def write_reachable(rooms, goals):
    """Write which goals [M, 13] can be achieved now; compiled because every turn of the meta-controller asks."""
    for m in range(rooms.shape[0]):
        room = rooms[m]
        for branch in range(room.n_rooms - 1):
            home, is_held, is_open = room.key_rooms[branch], room.keys >> branch & 1, room.doors >> branch & 1
            can_enter_home = home == 0 or room.doors >> (home - 1) & 1
            goals[m, room.colours[branch]] = can_enter_home and not is_held and not is_open
            goals[m, FIRST_DOOR_GOAL + room.colours[branch]] = is_held and not is_open
        goals[m, EXIT_GOAL] = room.doors >> (room.exit_room - 1) & 1


def reachable_goals(situation: Situation) -> NDArray[np.bool_]:
    """[M, 13] goals that can be achieved before anything else is."""
    return situation.reachable


def existing_goals(situation: Situation) -> NDArray[np.bool_]:
    """[M, 13] goals of the level that are not achieved yet."""
    closed = situation.exists & ~situation.doors
    return situation.by_goal(closed & ~situation.keys, closed, np.ones(len(situation), bool))


def seen_goals(situation: Situation) -> NDArray[np.bool_]:
    """[M, 13] goals that came into view this episode and are not achieved yet."""
    seen = situation.state.rooms["seen"][:, None] >> np.arange(N_GOALS) & 1
    return existing_goals(situation) & seen.astype(bool)


def all_goals(situation: Situation) -> NDArray[np.bool_]:
    """[M, 13] every goal id, whether it exists or not."""
    return np.ones((len(situation), N_GOALS), bool)


@dataclass(frozen=True)
class GoalMask:
    """Which goals a meta-controller may choose.

    Args:
        goals: from the situation of M rooms to the legal goals, [M, 13] bool.
        may_explore: whether 'no goal' is legal beside them; where there are none it always is.
    """

    goals: Callable[[Situation], NDArray[np.bool_]]
    may_explore: bool = False


GOAL_MASKS: Mapping[str, GoalMask] = {
    "reachable": GoalMask(reachable_goals),
    "existing": GoalMask(existing_goals),
    "seen": GoalMask(seen_goals, may_explore=True),
    "none": GoalMask(all_goals),
}
"""The goal masks by name. Under ``seen`` what matters may not have been seen yet, so one may ask for something new."""
