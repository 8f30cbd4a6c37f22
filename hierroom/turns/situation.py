"""What a meta-controller may know of the environments whose turn it is, and which goals it may choose there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.controller import Observation
from hierroom.goals import EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS, N_GOALS, NO_GOAL, GoalGraph
from hierroom.support.compile.kernel import compiled
from hierroom.support.errors import InputError
from hierroom.turns.kernels import ALL, EXISTING, REACHABLE, SEEN, write_masks
from hierroom.worlds.escape_room.layout import LEVEL, State
from hierroom.worlds.escape_room.level import Level

NO_GOAL_ACTION = N_GOALS
"""The meta-controller's 14th action: no goal. While it is not its turn, this is the one it may take: wait."""
N_META_ACTIONS = N_GOALS + 1
_BRANCHES = np.arange(N_COLOURS)


@dataclass(frozen=True)
class Situation(Observation):
    """What a meta-controller may know of M environments: an `Observation`, and besides it their exact state.

    ``goals`` are those of its last options that ended; ``masks`` [M, 14] the legal choices, 'no goal' the last.

    Args:
        grids: [M, side, side] uint8 tile codes of the levels, copied.
        meta_turns: [M] int, turns it has taken this episode.
        uniforms: [M, 14] float in [0, 1), random numbers for this turn, one for each goal id and one for no goal. They
            are fixed by seed, environment, episode and turn: a choice made with them is the same in whatever batch.
    """

    grids: NDArray[np.uint8]
    meta_turns: NDArray[np.integer]
    uniforms: NDArray[np.float64]

    def as_dict(self) -> dict[str, NDArray]:
        """As `Observation.as_dict`, and ``outcome`` [M] int64: how the last option ended."""
        return {**super().as_dict(), "outcome": self.outcomes.astype(np.int64)}

    @property
    def state(self) -> State:
        """The exact state of the M environments."""
        return State(self.grids, self.levels)

    @property
    def legal(self) -> NDArray[np.bool_]:
        """[M, 13] the goals that may be chosen; a row may be empty."""
        return self.masks[:, :N_GOALS]

    def chosen(self, actions: ArrayLike) -> tuple[NDArray[np.integer], NDArray[np.bool_]]:
        """The goals that the meta-controller's actions mean.

        Args:
            actions: [M] whole numbers: goal ids, or no goal (13 or -1).

        Returns:
            [M] goal ids, -1 for no goal and for what is not legal, and [M] whether the actions are legal.
        """
        given = np.asarray(actions)
        if given.shape != self.envs.shape or given.dtype.kind not in "iu":
            raise InputError(
                f"the meta-controller's choice must be {len(self)} goal ids (whole numbers, one for each environment "
                f"whose turn it is), not an array of {given.dtype} and shape {given.shape}"
            )
        in_range = (given >= NO_GOAL) & (given < N_META_ACTIONS)
        choices = np.where(in_range, given, NO_GOAL_ACTION).astype(np.int64)  # an unsigned number has no place for -1
        choices[choices == NO_GOAL] = NO_GOAL_ACTION
        is_legal = in_range & self.masks[np.arange(len(self)), choices]
        return np.where(is_legal & (choices < N_GOALS), choices, NO_GOAL), is_legal

    def level(self, m: int) -> Level:
        """The m-th environment in words: its goals, its agent and its goal graph."""
        return Level.of(self.state[m], self.legal[m], self.reachable[m])

    @cached_property
    def exists(self) -> NDArray[np.bool_]:
        """[M, 6] whether branch room 1, 2, ... is there."""
        return self.levels["n_rooms"][:, None] - 1 > _BRANCHES

    @cached_property
    def keys(self) -> NDArray[np.bool_]:
        """[M, 6] whether the key of branch room 1, 2, ... is held."""
        return (self.levels["keys"][:, None] >> _BRANCHES & 1).astype(bool)

    @cached_property
    def doors(self) -> NDArray[np.bool_]:
        """[M, 6] whether the door of branch room 1, 2, ... is open."""
        return (self.levels["doors"][:, None] >> _BRANCHES & 1).astype(bool)

    @property
    def colours(self) -> NDArray[np.integer]:
        """[M, 6] colour of branch room 1, 2, ...: the key's goal id; the door's is 6 more."""
        return self.levels["colours"]

    @property
    def key_rooms(self) -> NDArray[np.integer]:
        """[M, 6] room in which the key of branch room 1, 2, ... lay at the start."""
        return self.levels["key_rooms"]

    @cached_property
    def reachable(self) -> NDArray[np.bool_]:
        """[M, 13] goals that can be achieved before anything else is: `GoalGraph.open_goals` by goal id."""
        return GOAL_MASKS["reachable"].goals(self)

    def graph(self, m: int) -> GoalGraph:
        """The goal graph of the m-th environment."""
        level = self.levels[m]
        return GoalGraph(tuple(level.key_rooms[: level.n_rooms - 1].tolist()), int(level.exit_room))

    def by_goal(self, keys: NDArray, doors: NDArray, exits: NDArray) -> NDArray:
        """Values per branch room [M, 6], [M, 6] and per room [M] as values per goal id [M, 13]."""
        values = np.empty((len(self), N_GOALS), keys.dtype)
        rows, colours = np.arange(len(self))[:, None], self.colours
        values[rows, colours] = keys
        values[rows, colours + FIRST_DOOR_GOAL] = doors
        values[:, EXIT_GOAL] = exits
        return values


@dataclass(frozen=True)
class GoalMask:
    """Which goals a meta-controller may choose.

    Args:
        kind: as `turn_kernels.write_goals` takes it.
    """

    kind: int

    def goals(self, situation: Situation) -> NDArray[np.bool_]:
        """The legal goals, [M, 13], of the situation of M environments."""
        return self.masks(situation.levels, np.ones(len(situation), bool))[:, :N_GOALS]

    def masks(self, levels: np.ndarray, are_turns: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """The meta-controller's legal actions.

        Args:
            levels: [M] records of `layout.LEVEL`.
            are_turns: [M] bool, where it has its turn; elsewhere it can only wait.

        Returns:
            [M, 14] bool.
        """
        masks = np.empty((len(levels), N_META_ACTIONS), bool)
        _compiled_masks()(np.ascontiguousarray(levels), np.ascontiguousarray(are_turns), self.kind, masks)
        return masks


@cache
def _compiled_masks() -> Callable[..., None]:
    """Compile `turn_kernels.write_masks` for the types of a batch's arrays."""
    return compiled(write_masks, np.zeros(1, LEVEL), np.zeros(1, bool), 1, np.zeros((1, N_META_ACTIONS), bool))


GOAL_MASKS: Mapping[str, GoalMask] = {
    "reachable": GoalMask(REACHABLE),
    "existing": GoalMask(EXISTING),
    "seen": GoalMask(SEEN),
    "none": GoalMask(ALL),
}
"""The goal masks by name: goals that can be achieved before anything else is; goals of the level that are not achieved
yet; those of them that came into view this episode; every goal id, whether it exists or not. Under ``seen`` what
matters may not have been seen yet, so one may ask for something new."""
