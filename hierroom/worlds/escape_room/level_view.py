"""The view of M environments' levels, and for meta-controllers their exact state."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS, N_GOALS, GoalGraph
from hierroom.support.kernel import Compiled
from hierroom.worlds.escape_room import batch_kernels
from hierroom.worlds.escape_room.constants import VIEW
from hierroom.worlds.escape_room.goal_kernels import GOAL_MASKS, write_masks
from hierroom.worlds.escape_room.layout import LEVEL, NO_MAPS, OUTCOME, Maps, State
from hierroom.worlds.escape_room.level import Level, graph_of
from hierroom.worlds.escape_room.oracle import shortest_actions
from hierroom.worlds.escape_room.tiles import encode
from hierroom.worlds.random_kernels import turn_uniforms

OBSERVATION_SPACES: dict[str, spaces.Space] = {
    "observation": spaces.Box(0, 10, (VIEW, VIEW, 3), np.uint8),
    "direction": spaces.Discrete(4),
    "keys_held": spaces.Box(0, 1, (N_COLOURS,), np.int8),
    "doors_open": spaces.Box(0, 1, (N_COLOURS,), np.int8),
}
_BRANCHES = np.arange(N_COLOURS)


@dataclass(frozen=True, eq=False)
class LevelView:
    """The view of M environments: ``tiles`` [M, 7, 7] in view and records of `layout.LEVEL`.

    ``maps`` are the fixed levels. ``grids`` [M, side, side], the tile codes of the whole levels, are only for
    meta-controllers.
    """

    tiles: NDArray[np.uint8]
    levels: np.ndarray
    maps: Maps = NO_MAPS
    grids: NDArray[np.uint8] | None = None

    def __len__(self) -> int:
        return len(self.levels)

    def as_dict(self) -> dict[str, NDArray]:
        """Return the observation's entries, in fresh arrays.

        Returns:
            ``observation`` [M, 7, 7, 3] uint8 as MiniGrid's ``image``: cell [i, j] is i - 3 cells to the agent's right
            and 6 - j ahead. Its channels are MiniGrid's object id, its colour id, and 1 for an open door. ``direction``
            [M] int64, 0 east, 1 south, 2 west, 3 north. ``keys_held`` and ``doors_open`` [M, 6] int8 by colour, the
            keys held and the doors open.
        """
        levels, branches = self.levels, self.levels["branches"]
        return {
            "observation": encode(self.tiles),
            "direction": levels["direction"].astype(np.int64),
            "keys_held": (levels["keys"][:, None] >> branches & 1).astype(np.int8),
            "doors_open": (levels["doors"][:, None] >> branches & 1).astype(np.int8),
        }

    def uniforms(self, turns: NDArray[np.integer], n: int) -> NDArray[np.float64]:
        """Return [M, n] random numbers in [0, 1), determined by seed, environment, episode and turn [M]."""
        uniforms = np.empty((len(self), n))
        _UNIFORMS.run(np.ascontiguousarray(self.levels), np.ascontiguousarray(turns, np.int64), uniforms)
        return uniforms

    @property
    def state(self) -> State:
        """The exact state of the M environments."""
        assert self.grids is not None  # only meta-controllers read it
        return State(self.grids, self.levels, self.maps)

    def level(self, m: int, legal: NDArray[np.bool_]) -> Level:
        """Return the m-th environment in words; ``legal`` [G] marks the goals that may be chosen."""
        return Level.of(self.state[m], legal, self.reachable[m])

    def graph(self, m: int) -> GoalGraph:
        """Return the goal graph of the m-th environment."""
        return graph_of(self.levels[m])

    @cached_property
    def exists(self) -> NDArray[np.bool_]:
        """Flags [M, 6] whether branch room 1, 2, ... exists."""
        return self.levels["n_rooms"][:, None] - 1 > _BRANCHES

    @cached_property
    def keys(self) -> NDArray[np.bool_]:
        """Flags [M, 6] whether the key of branch room 1, 2, ... is held."""
        return (self.levels["keys"][:, None] >> _BRANCHES & 1).astype(bool)

    @cached_property
    def doors(self) -> NDArray[np.bool_]:
        """Flags [M, 6] whether the door of branch room 1, 2, ... is open."""
        return (self.levels["doors"][:, None] >> _BRANCHES & 1).astype(bool)

    @property
    def colours(self) -> NDArray[np.integer]:
        """Colours [M, 6] of branch room 1, 2, ...: the key's goal id; the door's is 6 more."""
        return self.levels["colours"]

    @property
    def key_rooms(self) -> NDArray[np.integer]:
        """Rooms [M, 6] that had the key of branch room 1, 2, ... at the start."""
        return self.levels["key_rooms"]

    @cached_property
    def reachable(self) -> NDArray[np.bool_]:
        """Goals that can be achieved now, before any other goal, [M, 13]."""
        return self.goals_by("reachable")

    @cached_property
    def seen(self) -> NDArray[np.bool_]:
        """Goals of the level that came into view this episode and are not achieved yet, [M, 13]."""
        return self.goals_by("seen")

    def goals_by(self, mask: str) -> NDArray[np.bool_]:
        """Return the goals [M, 13] that a goal mask allows on the meta-controller's turn."""
        return legal_goals(self.levels, mask, np.ones(len(self), bool))[:, :N_GOALS]

    @cached_property
    def depth_first_ranks(self) -> NDArray[np.integer]:
        """Ranks [M, 13] of goals in a depth-first walk, the next goal highest: exit, door of a held key, latest key."""
        opened_at = np.zeros((len(self), 1 + N_COLOURS), np.int64)  # of every room; the centre is open from step 0
        opened_at[:, 1:] = self.levels["opened_at"]
        recency = opened_at[np.arange(len(self))[:, None], self.key_rooms]  # [M, 6] of the key's room
        later = self.levels["max_steps"].astype(np.int64) + 1
        return self.by_goal(recency, recency + later[:, None], 2 * later)

    @property
    def oracle_goals(self) -> NDArray[np.integer]:
        """First goals [M] on a shortest path to the exit."""
        return np.array([_first_goal(self.state[m]) for m in range(len(self))])

    def by_goal(self, keys: NDArray, doors: NDArray, exits: NDArray) -> NDArray:
        """Return values per branch room [M, 6], [M, 6] and per room [M] as values per goal id [M, 13]."""
        values = np.empty((len(self), N_GOALS), keys.dtype)
        rows, colours = np.arange(len(self))[:, None], self.colours
        values[rows, colours] = keys
        values[rows, colours + FIRST_DOOR_GOAL] = doors
        values[:, EXIT_GOAL] = exits
        return values


def legal_goals(levels: np.ndarray, mask: str, are_turns: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the meta-controllers' legal choices [M, 14] under a mask of `GOAL_MASKS`; only 'no goal' off turn."""
    masks = np.empty((len(levels), N_GOALS + 1), bool)
    _MASKS.run(np.ascontiguousarray(levels), np.ascontiguousarray(are_turns), GOAL_MASKS[mask], masks)
    return masks


_MASKS = Compiled(write_masks, np.zeros(1, LEVEL), np.zeros(1, bool), 1, np.zeros((1, 1), bool))
_UNIFORMS = Compiled(turn_uniforms, np.zeros(1, LEVEL), np.zeros(1, np.int64), np.zeros((1, 1)))


def _first_goal(state: State) -> int:
    outcomes = np.zeros(1, OUTCOME)
    for action in shortest_actions(state):
        batch_kernels.step_levels(state.levels, state.grids, np.array([action], np.int64), outcomes)
        if achieved := int(outcomes["achieved"][0]):
            return achieved.bit_length() - 1
    return -1
