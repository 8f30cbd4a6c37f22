"""How environments lie in memory: records of a level under play, of what a step did, of a goal graph; their state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierroom.errors import InputError
from hierroom.goals import MAX_GRID_ROOMS, N_COLOURS, GoalGraph
from hierroom.world.kernels import DOORWAYS, EXPLORED, MARGIN, VIEW, VISITED

MIN_SIZE, MAX_SIZE = 11, 63


def _record(*fields: tuple) -> np.dtype:
    return np.dtype((np.record, np.dtype(list(fields), align=True)))


GRAPH = _record(("n_rooms", "i4"), ("exit_room", "i4"), ("key_rooms", "i4", N_COLOURS))
"""A goal graph as kernels read it."""

LEVEL = _record(
    # Where the random numbers of the environment come from.
    ("seed", "u8"),
    ("index", "i8"),  # the environment's number; it gives the same episodes in whatever batch it runs
    ("episode", "i8"),
    ("key", "u8"),
    ("n_drawn", "u8"),
    # The rules it is played by.
    ("max_steps", "i4"),
    ("can_drop", "?"),
    ("remembers", "i4"),  # which of `MEMORIES` are kept, as bits
    # The level. Rows and columns count the margin of walls.
    ("n_rooms", "i4"),
    ("exit_room", "i4"),
    ("key_rooms", "i4", N_COLOURS),
    ("colours", "i4", N_COLOURS),  # colour of branch room 1, 2, ...
    ("branches", "i4", N_COLOURS),  # its inverse: branch room - 1 of each colour
    ("rectangles", "i4", (MAX_GRID_ROOMS, 4)),  # top, left, bottom, right cell of rooms 0, 1, ...
    ("doors_at", "i4", (N_COLOURS, 2)),  # (row, col)
    ("keys_at", "i4", (N_COLOURS, 2)),  # where its key lies, or lay before it was picked up
    ("exit_at", "i4", 2),  # (row, col)
    ("divider", "i4", 4),  # where each side would be halved
    # The agent.
    ("row", "i4"),
    ("col", "i4"),
    ("direction", "i4"),
    ("steps", "i4"),
    ("keys", "i4"),  # bit branch: its key is held
    ("doors", "i4"),  # bit branch: its door is open
    ("doorways", "i4", (2, 2)),  # (row, col) of the two doors opened or walked through last, the later one first, or 0
    ("opened_at", "i4", N_COLOURS),  # the step that opened its door, or 0 while it is locked
    ("found", "i4"),  # bit branch: its key was held at some time this episode
    ("seen", "i4"),  # bit goal id: it was in view at some time this episode
    # By row: bit col (both without the margin), the agent was there since it found another key or opened another door.
    ("visited", "u8", MAX_SIZE),
    ("explored", "u8", MAX_SIZE),  # likewise: the cell was in view this episode
    ("bag", "i4", N_COLOURS),  # branches of the keys held, in the order of pick-up
    ("bag_size", "i4"),
    ("carried", "i4"),  # branch of the key that drop would put down, or -1
    ("has_ended", "?"),
)

OUTCOME = _record(
    ("tiles", "u1", (VIEW, VIEW)),  # the view to act on next
    ("final_tiles", "u1", (VIEW, VIEW)),  # the last view of the episode that this step ended
    ("event", "i4"),  # goal id achieved by this step, or -1
    ("is_first", "?"),  # ... for the first time this episode
    ("is_novel", "?"),  # no step before this one left the agent on that cell with those keys found and doors open
    ("is_discovery", "?"),  # a key, door or exit of this level came into view for the first time this episode
    ("reward", "f8"),  # extrinsic
    ("terminated", "?"),
    ("truncated", "?"),
    ("length", "i4"),  # steps of the episode so far, this one included
)


MEMORIES: Mapping[str, int] = {"visited": VISITED, "explored": EXPLORED, "doorways": DOORWAYS}
"""What a level can remember of its episode, in the fields of `LEVEL` of those names; kept only where asked for."""


@dataclass(frozen=True)
class State:
    """The exact state of N environments, as plain arrays.

    Args:
        grids: [N, size + 2 * MARGIN, size + 2 * MARGIN] uint8 tile codes.
        levels: [N] records of `LEVEL`.
    """

    grids: NDArray[np.uint8]
    levels: np.ndarray

    def __len__(self) -> int:
        return len(self.levels)

    def __getitem__(self, indices) -> State:
        """The state of some of the environments, copied; an integer gives a batch of one."""
        chosen = np.atleast_1d(np.arange(len(self))[indices])
        return State(self.grids[chosen], self.levels[chosen])

    def copy(self) -> State:
        """The same state in arrays of its own."""
        return State(self.grids.copy(), self.levels.copy())

    @property
    def size(self) -> int:
        """Cells of the grid's side, its outer walls included."""
        return self.grids.shape[1] - 2 * MARGIN


def empty_state(num_envs: int, size: int) -> State:
    """The state of environments whose episodes have not begun, all zeros."""
    if not isinstance(size, (int, np.integer)) or not MIN_SIZE <= size <= MAX_SIZE:
        raise InputError(f"size must be a whole number from {MIN_SIZE} to {MAX_SIZE}, not {size}")
    if not isinstance(num_envs, (int, np.integer)) or num_envs < 1:
        raise InputError(f"num_envs must be a whole number of at least 1, not {num_envs!r}")
    side = size + 2 * MARGIN
    return State(np.zeros((num_envs, side, side), np.uint8), np.zeros(num_envs, LEVEL))


def graph_records(graphs: Sequence[GoalGraph]) -> np.ndarray:
    """Goal graphs as the records [P] that kernels draw levels from.

    Raises:
        InputError: if there is none, or one has more rooms than a grid can hold.
    """
    if not graphs:
        raise InputError("levels need at least one goal graph, and were given none")
    records = np.zeros(len(graphs), GRAPH)
    for record, graph in zip(records, graphs, strict=True):
        if graph.n_rooms > MAX_GRID_ROOMS:
            raise InputError(
                f"a grid holds at most {MAX_GRID_ROOMS} rooms (one colour for each locked door), "
                f"but the goal graph has {graph.n_rooms}"
            )
        record.n_rooms, record.exit_room = graph.n_rooms, graph.exit_room
        record.key_rooms[: graph.n_rooms - 1] = graph.key_rooms
    return records
