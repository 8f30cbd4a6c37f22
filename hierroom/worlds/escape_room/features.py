"""Features: what a network reads of an observation, as small whole numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierroom.agents.config import require_features
from hierroom.controller import Observation
from hierroom.goals import COLOURS, EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS, N_GOALS, NO_GOAL
from hierroom.support.compile.kernel import njit
from hierroom.support.errors import InputError
from hierroom.turns.ledger import CONTROLLER
from hierroom.turns.records import N_OUTCOMES, NO_OUTCOME
from hierroom.worlds.escape_room.constants import COL_STEP, EXIT, KEY, LOCKED_DOOR, N_TILES, ROW_STEP, VIEW
from hierroom.worlds.escape_room.frontier import nearest_frontiers
from hierroom.worlds.escape_room.tiles import TRIPLES

N_CELLS = VIEW * VIEW
CLASS_STARTS = np.array([1, 2, 3, 4, 8, 16])
"""Distances along an axis at which the next of seven classes begins: 0, 1, 2, 3, 4 to 7, 8 to 15, 16 and more cells."""
UNKNOWN_DISTANCE = 2 * len(CLASS_STARTS) + 1
"""The class of a distance that is not known; the others go from far behind or left to far ahead or right."""


@dataclass(frozen=True)
class Feature:
    """One thing that a network can read of an observation: one whole number or several.

    Args:
        cardinalities: from the controller's number of actions to the number of values of each of its numbers.
        encode: from an observation of M environments to [M, numbers] whole numbers below the cardinalities.
        vectors: [cardinality, d] fixed numbers that stand for each value, or None: a learned row for each value.
        memories: what levels must remember for it, names in `layout.MEMORIES`.
        is_by_goal: whether it has one number for each goal id.
    """

    cardinalities: Callable[[int], tuple[int, ...]]
    encode: Callable[[Observation], NDArray]
    vectors: NDArray | None = None
    memories: tuple[str, ...] = ()
    is_by_goal: bool = False


def _goal_categories() -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """For each goal id and, last, no goal: its (object, colour) as categories, 0 for none; its tile code."""
    categories = np.zeros((N_GOALS + 1, 2), np.uint8)
    tiles = np.full(N_GOALS + 1, N_TILES, np.uint8)
    colours = np.arange(N_COLOURS)
    categories[:N_COLOURS] = np.stack([np.full(N_COLOURS, 1), 1 + colours], axis=1)
    categories[FIRST_DOOR_GOAL:EXIT_GOAL] = np.stack([np.full(N_COLOURS, 2), 1 + colours], axis=1)
    categories[EXIT_GOAL] = 3, 1 + COLOURS.index("green")
    tiles[:N_COLOURS], tiles[FIRST_DOOR_GOAL:EXIT_GOAL], tiles[EXIT_GOAL] = KEY + colours, LOCKED_DOOR + colours, EXIT
    return categories, tiles


_GOAL_CATEGORIES, _GOAL_TILES = _goal_categories()
_GOAL_IDS = np.arange(N_GOALS)


def _goal_cells(observation: Observation) -> NDArray:
    """[M, 1] the cell of the view that holds the goal, or 49: colours differ, so there is one at most."""
    is_goal = observation.tiles.reshape(-1, N_CELLS) == _GOAL_TILES[observation.goals][:, None]
    return np.where(is_goal.any(axis=1), is_goal.argmax(axis=1), N_CELLS)[:, None]


def _goal_place(observation: Observation) -> NDArray:
    """[M, 2] `_places` of the goal where it was seen last: nothing moves unseen; a key in hand stays where it lay."""
    return _places(observation.levels, _seen_at(observation.levels, observation.goals[:, None]))


def _object_places(observation: Observation) -> NDArray:
    """[M, 26] likewise of every goal, by id, whichever the controller has."""
    goals = np.broadcast_to(_GOAL_IDS, (len(observation.levels), N_GOALS))
    return _places(observation.levels, _seen_at(observation.levels, goals))


def _doorway_places(observation: Observation) -> NDArray:
    """[M, 4] `_places` of the two doors that were opened or walked through last, the later one first."""
    return _places(observation.levels, observation.levels["doorways"])


def _frontier_places(observation: Observation) -> NDArray:
    """[M, 4] `_places` of what `nearest_frontiers` finds."""
    return _places(observation.levels, nearest_frontiers(observation.levels))


@njit(cache=True)
def _seen_at(levels, goals):
    """[M, G, 2] (row, col) of those goals [M, G] that were seen this episode, zeros for the others and for no goal."""
    cells = np.zeros((*goals.shape, 2), np.int64)
    for m, g in np.ndindex(goals.shape):
        goal = goals[m, g]
        if goal != NO_GOAL and (levels[m].seen >> goal) & 1:
            branch = levels[m].branches[goal % N_COLOURS]
            if goal < FIRST_DOOR_GOAL:
                cells[m, g] = levels[m].keys_at[branch]
            elif goal < EXIT_GOAL:
                cells[m, g] = levels[m].doors_at[branch]
            else:
                cells[m, g] = levels[m].exit_at
    return cells


@njit(cache=True)
def _places(levels, cells):
    """[M, 2 C] how far ahead of the agent and how far to its right each of some cells [M, C, 2] is.

    Each is the class of the distance, -6 to 6, plus 6; `UNKNOWN_DISTANCE` where the cell's row is 0, as none's is.
    """
    places = np.full((cells.shape[0], 2 * cells.shape[1]), UNKNOWN_DISTANCE)
    for m in range(cells.shape[0]):
        row_step, col_step = ROW_STEP[levels[m].direction], COL_STEP[levels[m].direction]
        for c in range(cells.shape[1]):
            if cells[m, c, 0] > 0:
                down, east = cells[m, c, 0] - levels[m].row, cells[m, c, 1] - levels[m].col
                places[m, 2 * c] = _class_of(down * row_step + east * col_step)
                places[m, 2 * c + 1] = _class_of(down * col_step - east * row_step)
    return places


@njit(cache=True)
def _class_of(distance):
    classes = np.searchsorted(CLASS_STARTS, abs(distance), side="right")
    return len(CLASS_STARTS) + (classes if distance > 0 else -classes)


def _by_colour(observation: Observation, what: str) -> NDArray:
    """[M, 6] the bits of ``keys`` or ``doors``."""
    return observation.levels[what][:, None] >> observation.levels["branches"] & 1


def _goal_status(observation: Observation) -> NDArray:
    """[M, 13] for each goal id 0 for never seen, 1 for seen this episode, 2 for a key in hand or an open door."""
    status = observation.levels["seen"][:, None] >> _GOAL_IDS & 1
    achieved = np.concatenate([_by_colour(observation, "keys"), _by_colour(observation, "doors")], axis=1)
    status[:, :EXIT_GOAL][achieved > 0] = 2
    return status


def _goal_outcome(observation: Observation) -> NDArray:
    """[M, 13] for the last goal how its option ended, for the others 0."""
    return np.where(observation.goals[:, None] == _GOAL_IDS, observation.outcomes[:, None], NO_OUTCOME)


def _view(observation: Observation) -> NDArray:
    """[M, 49] the tile codes of the view."""
    return observation.tiles.reshape(-1, N_CELLS)


_PLACE = UNKNOWN_DISTANCE + 1

FEATURES: Mapping[str, Feature] = {
    "view": Feature(lambda _: (N_TILES,) * N_CELLS, _view),
    "view-ids": Feature(lambda _: (N_TILES,) * N_CELLS, _view, TRIPLES.astype(np.float32)),
    "goal": Feature(lambda _: (4, 1 + N_COLOURS), lambda observation: _GOAL_CATEGORIES[observation.goals]),
    "goal-in-view": Feature(lambda _: (N_CELLS + 1,), _goal_cells),
    "goal-place": Feature(lambda _: (_PLACE,) * 2, _goal_place),
    "object-places": Feature(lambda _: (_PLACE,) * 2 * N_GOALS, _object_places),
    "doorway-places": Feature(lambda _: (_PLACE,) * 4, _doorway_places, memories=("doorways",)),
    "frontier-places": Feature(lambda _: (_PLACE,) * 4, _frontier_places, memories=("explored",)),
    "symbol": Feature(lambda _: (N_GOALS + 1,), lambda observation: (observation.goals % (N_GOALS + 1))[:, None]),
    "direction": Feature(lambda _: (4,), lambda observation: observation.levels["direction"][:, None]),
    "keys": Feature(lambda _: (2,) * N_COLOURS, lambda observation: _by_colour(observation, "keys")),
    "previous-action": Feature(lambda n_actions: (n_actions + 1,), lambda o: o.previous_actions[:, None]),
    "goal-status": Feature(lambda _: (3,) * N_GOALS, _goal_status, is_by_goal=True),
    "goal-outcome": Feature(lambda _: (N_OUTCOMES,) * N_GOALS, _goal_outcome, is_by_goal=True),
}
"""view: the tile of each cell of the view; view-ids: likewise, read as its object id, colour id and open bit; goal:
object and colour; goal-in-view: the cell of the view that holds the goal; goal-place: about how far ahead of the agent
and to its right the goal is, once it was seen this episode; object-places: likewise for each goal id, whichever the
goal; doorway-places: likewise for the two doors that were opened or walked through last; frontier-places: likewise for
floor beside what was not seen yet, the nearest in the agent's room and the nearest elsewhere; symbol: the goal as one
of 14, no goal the last; direction; keys: those held, by colour; previous-action: the last action taken; goal-status:
whether each goal was seen this episode, and whether the key is in hand or the door open; goal-outcome: how the last
option ended. A meta-controller's goal is the one it gave last."""

GOAL_FEATURES = ("goal", "goal-in-view", "goal-place", "symbol")
"""Features of the goal: left out by methods whose controller does not see it."""


@dataclass(frozen=True)
class Features:
    """The features of one agent, side by side.

    Args:
        names: names in `FEATURES`, in order.
        n_actions: the controller's actions.
        agent: whose they are: how the last option ended is for meta-controllers alone.
    """

    names: Sequence[str]
    n_actions: int
    agent: str = CONTROLLER

    def __post_init__(self) -> None:
        require_features("features", self.names)
        if self.agent == CONTROLLER and "goal-outcome" in self.names:
            raise InputError("goal-outcome is how the last option ended: one of meta_features, not of features")

    @property
    def cardinalities(self) -> tuple[int, ...]:
        """Number of values of each of the K numbers."""
        return tuple(c for name in self.names for c in FEATURES[name].cardinalities(self.n_actions))

    @property
    def vectors(self) -> list[NDArray | None] | None:
        """For each of the K numbers the fixed numbers that stand for its values, if any; None where none has any."""
        vectors = [FEATURES[name].vectors for name in self.names for _ in FEATURES[name].cardinalities(self.n_actions)]
        return None if all(of_number is None for of_number in vectors) else vectors

    @property
    def are_by_goal(self) -> bool:
        """Whether each of them has one number for each goal id, so that a network can treat all colours alike."""
        return all(FEATURES[name].is_by_goal for name in self.names)

    @property
    def memories(self) -> tuple[str, ...]:
        """What levels must remember for them, names in `layout.MEMORIES`."""
        return tuple(memory for name in self.names for memory in FEATURES[name].memories)

    def encode(self, observation: Observation) -> NDArray[np.uint8]:
        """[M, K] uint8, the features of M environments."""
        return np.concatenate(
            [FEATURES[name].encode(observation) for name in self.names], axis=1, dtype=np.uint8, casting="unsafe"
        )
