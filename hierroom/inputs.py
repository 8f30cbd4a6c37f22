"""What a learning agent is fed: columns of small categories, made from what there is to be seen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from hierroom.controller import Sight
from hierroom.errors import InputError
from hierroom.frontier import nearest_frontiers
from hierroom.goals import COLOURS, EXIT_GOAL, FIRST_DOOR_GOAL, N_COLOURS, N_GOALS, NO_GOAL
from hierroom.step import N_OUTCOMES, NO_OUTCOME
from hierroom.world.kernels import COL_STEP, EXIT, KEY, LOCKED_DOOR, N_TILES, ROW_STEP, VIEW
from hierroom.world.tiles import TRIPLES

N_CELLS = VIEW * VIEW
CLASS_STARTS = np.array([1, 2, 3, 4, 8, 16])
"""Distances along an axis at which the next of seven classes begins: 0, 1, 2, 3, 4 to 7, 8 to 15, 16 and more cells."""
UNKNOWN_DISTANCE = 2 * len(CLASS_STARTS) + 1
"""The code of a distance that is not known; the others are classes from far behind or left to far ahead or right."""


@dataclass(frozen=True)
class Input:
    """One thing an agent can be fed.

    Args:
        cardinalities: from the controller's number of actions to the number of values of each column.
        codes: what to feed: from a sight of M rooms to [M, columns] whole numbers below the cardinalities.
        vectors: [cardinality, d] fixed numbers fed for each value, or None: a learned row for each value.
    """

    cardinalities: Callable[[int], tuple[int, ...]]
    codes: Callable[[Sight], NDArray]
    vectors: NDArray | None = None


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


def _goal_cells(sight: Sight) -> NDArray:
    """[M, 1] the cell of the view that holds the goal, or 49: colours differ, so there is one at most."""
    is_goal = sight.tiles.reshape(-1, N_CELLS) == _GOAL_TILES[sight.goals][:, None]
    return np.where(is_goal.any(axis=1), is_goal.argmax(axis=1), N_CELLS)[:, None]


def _goal_place(sight: Sight) -> NDArray:
    """[M, 2] `_places` of the goal where it was seen last: nothing moves unseen; a key in hand stays where it lay."""
    return _places(sight.rooms, _seen_at(sight.rooms, sight.goals))


def _doorway_places(sight: Sight) -> NDArray:
    """[M, 4] `_places` of the two doors that were opened or walked through last, the later one first."""
    return _places(sight.rooms, sight.rooms["doorways"])


def _frontier_places(sight: Sight) -> NDArray:
    """[M, 4] `_places` of what `nearest_frontiers` finds."""
    return _places(sight.rooms, nearest_frontiers(sight.rooms))


@njit(cache=True)
def _seen_at(rooms, goals):
    """[M, 1, 2] (row, col) of the goals that were seen this episode, zeros for the others and for no goal."""
    cells = np.zeros((len(goals), 1, 2), np.int64)
    for m in range(len(goals)):
        goal = goals[m]
        if goal != NO_GOAL and (rooms[m].seen >> goal) & 1:
            branch = rooms[m].branches[goal % N_COLOURS]
            if goal < FIRST_DOOR_GOAL:
                cells[m, 0] = rooms[m].keys_at[branch]
            elif goal < EXIT_GOAL:
                cells[m, 0] = rooms[m].doors_at[branch]
            else:
                cells[m, 0] = rooms[m].exit_at
    return cells


@njit(cache=True)
def _places(rooms, cells):
    """[M, 2 C] how far ahead of the agent and how far to its right each of some cells [M, C, 2] is.

    Each is the class of the distance, -6 to 6, plus 6; `UNKNOWN_DISTANCE` where the cell's row is 0, as none's is.
    """
    places = np.full((cells.shape[0], 2 * cells.shape[1]), UNKNOWN_DISTANCE)
    for m in range(cells.shape[0]):
        row_step, col_step = ROW_STEP[rooms[m].direction], COL_STEP[rooms[m].direction]
        for c in range(cells.shape[1]):
            if cells[m, c, 0] > 0:
                down, east = cells[m, c, 0] - rooms[m].row, cells[m, c, 1] - rooms[m].col
                places[m, 2 * c] = _class_of(down * row_step + east * col_step)
                places[m, 2 * c + 1] = _class_of(down * col_step - east * row_step)
    return places


@njit(cache=True)
def _class_of(distance):
    classes = np.searchsorted(CLASS_STARTS, abs(distance), side="right")
    return len(CLASS_STARTS) + (classes if distance > 0 else -classes)


def _by_colour(sight: Sight, what: str) -> NDArray:
    """[M, 6] the bits of ``keys`` or ``doors``."""
    return sight.rooms[what][:, None] >> sight.rooms["branches"] & 1


def _goal_status(sight: Sight) -> NDArray:
    """[M, 13] for each goal id 0 for never seen, 1 for seen this episode, 2 for achieved."""
    status = sight.rooms["seen"][:, None] >> _GOAL_IDS & 1
    achieved = np.concatenate([_by_colour(sight, "keys"), _by_colour(sight, "doors")], axis=1)
    status[:, :EXIT_GOAL][achieved > 0] = 2
    return status


def _goal_outcome(sight: Sight) -> NDArray:
    """[M, 13] for the last goal how its life ended, for the others 0."""
    return np.where(sight.goals[:, None] == _GOAL_IDS, sight.outcomes[:, None], NO_OUTCOME)


INPUTS: Mapping[str, Input] = {
    "view": Input(lambda _: (N_TILES,) * N_CELLS, lambda sight: sight.tiles.reshape(-1, N_CELLS)),
    "view-ids": Input(
        lambda _: (N_TILES,) * N_CELLS, lambda sight: sight.tiles.reshape(-1, N_CELLS), TRIPLES.astype(np.float32)
    ),
    "goal": Input(lambda _: (4, 1 + N_COLOURS), lambda sight: _GOAL_CATEGORIES[sight.goals]),
    "goal-in-view": Input(lambda _: (N_CELLS + 1,), _goal_cells),
    "goal-place": Input(lambda _: (UNKNOWN_DISTANCE + 1,) * 2, _goal_place),
    "doorway-places": Input(lambda _: (UNKNOWN_DISTANCE + 1,) * 4, _doorway_places),
    "frontier-places": Input(lambda _: (UNKNOWN_DISTANCE + 1,) * 4, _frontier_places),
    "symbol": Input(lambda _: (N_GOALS + 1,), lambda sight: (sight.goals % (N_GOALS + 1))[:, None]),
    "direction": Input(lambda _: (4,), lambda sight: sight.rooms["direction"][:, None]),
    "keys": Input(lambda _: (2,) * N_COLOURS, lambda sight: _by_colour(sight, "keys")),
    "previous-action": Input(lambda n_actions: (n_actions + 1,), lambda sight: sight.previous_actions[:, None]),
    "goal-status": Input(lambda _: (3,) * N_GOALS, _goal_status),
    "goal-outcome": Input(lambda _: (N_OUTCOMES,) * N_GOALS, _goal_outcome),
}
"""view: a learned row for each tile at each cell; view-ids: its object id, colour id and open bit as numbers; goal:
object and colour; goal-in-view: the cell of the view that holds the goal; goal-place: about how far ahead of the
agent and to its right the goal is, once it was seen this episode; doorway-places: likewise for the two doors that were
opened or walked through last; frontier-places: likewise for floor beside what was not seen yet, the nearest in the
agent's room and the nearest elsewhere; symbol: the goal as one of 14, no goal the last; direction; keys: those held, by
colour; previous-action: the last action taken; goal-status: whether each goal was seen or achieved this episode;
goal-outcome: how the life of the last goal ended. A meta-controller's goal is the one it gave last."""

GOAL_INPUTS = ("goal", "goal-in-view", "goal-place", "symbol")
"""Inputs that show the goal: left out by methods whose controller does not see it."""


@dataclass(frozen=True)
class InputColumns:
    """The inputs of one agent, side by side.

    Args:
        names: names in `INPUTS`, in order.
        n_actions: the controller's actions.

    Raises:
        InputError: if a name is unknown or there is none.
    """

    names: Sequence[str]
    n_actions: int

    def __post_init__(self) -> None:
        unknown = [name for name in self.names if name not in INPUTS]
        if unknown or not self.names:
            raise InputError(f"inputs are {', '.join(INPUTS)}; not {', '.join(unknown) or 'none at all'}")

    @property
    def cardinalities(self) -> tuple[int, ...]:
        """Number of values of each of the K columns."""
        return tuple(c for name in self.names for c in INPUTS[name].cardinalities(self.n_actions))

    @property
    def vectors(self) -> list[NDArray | None] | None:
        """For each column the fixed numbers it is fed as, if any; None where no column has any."""
        columns = [INPUTS[name].vectors for name in self.names for _ in INPUTS[name].cardinalities(self.n_actions)]
        return None if all(vectors is None for vectors in columns) else columns

    def codes(self, sight: Sight) -> NDArray[np.uint8]:
        """[M, K] uint8, what M rooms are fed."""
        return np.concatenate(
            [INPUTS[name].codes(sight) for name in self.names], axis=1, dtype=np.uint8, casting="unsafe"
        )
