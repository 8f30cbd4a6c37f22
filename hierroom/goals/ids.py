"""Goal ids: the 13 goals that a level can have, by colour.

Goals have two numberings. On a **graph** with ``n`` rooms the ``2 (n - 1) + 1`` goals are ordered by room. The key of
room ``r`` is ``r - 1``, its door is ``(n - 1) + r - 1``, and the exit is last. In a **level** the rooms have colours,
and a goal is one of 13 ids: the key of colour ``c`` is ``c``, its door is ``6 + c``, and the exit is 12.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

COLOURS = ("red", "green", "blue", "purple", "yellow", "grey")
"""Colour names in the order of MiniGrid's colour ids."""
N_COLOURS = len(COLOURS)
FIRST_DOOR_GOAL = N_COLOURS
EXIT_GOAL = 2 * N_COLOURS
N_GOALS = 2 * N_COLOURS + 1
NO_GOAL = -1
"""The goal id of 'no goal'; as an index into `GOAL_VECTORS` it selects the row of zeros."""
GOAL_NAMES = (*(f"{c} key" for c in COLOURS), *(f"{c} door" for c in COLOURS), "exit")

ROOM_GOAL_NAMES = (*(f"key {r}" for r in range(1, 7)), *(f"door {r}" for r in range(1, 7)), "exit")
"""The goals named by the room that a key or door opens, which does not depend on colours; see `room_goals`."""

MAX_GRID_ROOMS = N_COLOURS + 1
"""Number of rooms that a grid can hold: the centre room and a branch room for each colour."""


GOAL_VECTORS = np.zeros((N_GOALS + 1, 3 + N_COLOURS), np.float32)
"""One-hot object (key, door, exit) and one-hot colour of each goal id, [14, 9] float32; row -1 is 'no goal'."""
for _colour in range(N_COLOURS):
    GOAL_VECTORS[_colour, [0, 3 + _colour]] = 1
    GOAL_VECTORS[FIRST_DOOR_GOAL + _colour, [1, 3 + _colour]] = 1
GOAL_VECTORS[EXIT_GOAL, [2, 3 + COLOURS.index("green")]] = 1
GOAL_VECTORS.setflags(write=False)


def room_goals(goals: NDArray[np.integer], branches: NDArray[np.integer]) -> NDArray[np.integer]:
    """Return indices into `ROOM_GOAL_NAMES` for goal ids [M]; ``branches`` [M, 6] or [6] is each colour's room - 1."""
    rooms = np.broadcast_to(branches, (len(goals), N_COLOURS))[np.arange(len(goals)), goals % N_COLOURS]
    return np.where(goals == EXIT_GOAL, EXIT_GOAL, goals // N_COLOURS * N_COLOURS + rooms)
