"""N rooms stepped at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.errors import InputError
from hierroom.goals import GoalGraph
from hierroom.world import kernels
from hierroom.world.layout import GRAPH, MIN_SIZE, OUTCOME, ROOM, State, empty_state, graph_records

MIN_ROOMS_PER_THREAD = 1024
"""Below this, handing work to another thread costs more than it saves."""

Indices = NDArray[np.integer] | NDArray[np.bool_] | Sequence[int] | slice | int
"""Some rooms of a batch."""
INT64 = np.dtype(np.int64)


class Batch:
    """N EscapeRooms that are stepped together and begin their next episode by themselves.

    Each room is a stream of episodes fixed by ``(seed, room index, episode)``, whatever batch it is in and however
    many threads step it.

    Args:
        graphs: goal graphs; each episode draws one of them.
        batch_size: N, at least 1.
        size: cells of the grid's side, 11 to 63, outer walls included.
        max_steps: steps after which an episode is truncated, at least 1.
        drop_key: whether action 5 drops a key.
        seed: 0 to 2**63 - 1.
        first_index: the room index of the first room.
        threads: most threads to step with, at least 1; small batches use fewer.

    Attributes:
        state: the rooms' state, changed in place by each step.
        outcomes: [N] records of `layout.OUTCOME`, overwritten by each step.
        finals: [N] records of `layout.ROOM`: each room as its last episode left it.

    Raises:
        InputError: if an argument is out of its range or a graph has more rooms than a grid holds.
    """

    def __init__(
        self,
        graphs: Sequence[GoalGraph],
        batch_size: int = 1,
        *,
        size: int = 19,
        max_steps: int = 1000,
        drop_key: bool = False,
        seed: int = 0,
        first_index: int = 0,
        threads: int = 1,
    ):
        for name, value in (("max_steps", max_steps), ("threads", threads)):
            if not isinstance(value, (int, np.integer)) or not 1 <= value < 2**31:
                raise InputError(f"{name} must be a whole number from 1 to 2**31 - 1, not {value!r}")
        self.graph_records = graph_records(graphs)
        self.state = empty_state(batch_size, size)
        self.outcomes = np.zeros(batch_size, OUTCOME)
        self.finals = np.zeros(batch_size, ROOM)
        rooms = self.state.rooms
        rooms["index"] = first_index + np.arange(batch_size)
        rooms["max_steps"], rooms["can_drop"] = max_steps, drop_key
        self._shape = (batch_size,)
        self.n_actions = 6 if drop_key else 5
        n_slices = max(1, min(threads, batch_size // MIN_ROOMS_PER_THREAD))
        bounds = np.linspace(0, batch_size, n_slices + 1).astype(int)
        self._slices = [slice(a, b) for a, b in pairwise(bounds)]
        self._pool = ThreadPoolExecutor(len(self._slices)) if len(self._slices) > 1 else None
        self.reset(seed)

    def __len__(self) -> int:
        return len(self.outcomes)

    def reset(self, seed: int | None = None) -> None:
        """Begin an episode in every room: the first one of a seed, or without a seed each room's next."""
        if seed is not None:
            if not isinstance(seed, (int, np.integer)) or not 0 <= seed < 2**63:
                raise InputError(f"a seed is a whole number from 0 to 2**63 - 1, not {seed!r}")
            self.state.rooms["seed"], self.state.rooms["episode"] = seed, -1
        self._clear_outcomes(np.arange(len(self)), 0)
        kernels.reset_rooms(self.state.rooms, self.state.grids, self.graph_records, self.outcomes)

    def stagger_clocks(self) -> None:
        """Spread the step counts of the episodes under way evenly, so that rooms are not truncated together."""
        rooms = self.state.rooms
        rooms["steps"] = np.arange(len(self)) * rooms["max_steps"] // len(self)

    def set_graphs(self, graphs: Sequence[GoalGraph]) -> None:
        """Draw the graphs of later episodes from these."""
        self.graph_records = graph_records(graphs)

    def step(self, actions: ArrayLike) -> np.ndarray:
        """Act once in every room and return the outcomes; a room whose episode ends begins its next one.

        Args:
            actions: [N] whole numbers; one that is not an action of the room does nothing but costs the step.

        Raises:
            InputError: if that is not what the actions are.
        """
        actions, graphs, step = self._as_actions(actions), self.graph_records, _compiled_step()
        rooms, grids, outcomes, finals = self.state.rooms, self.state.grids, self.outcomes, self.finals
        if self._pool is None:
            step(rooms, grids, graphs, actions, outcomes, finals)
        else:
            parts = self._slices
            list(self._pool.map(lambda p: step(rooms[p], grids[p], graphs, actions[p], outcomes[p], finals[p]), parts))
        return outcomes

    def step_within_episode(self, actions: ArrayLike) -> np.ndarray:
        """Act once in every room whose episode is not over and return the outcomes; nothing is reset."""
        actions = self._as_actions(actions)
        kernels.step_rooms(self.state.rooms, self.state.grids, actions, self.outcomes)
        return self.outcomes

    def get_state(self, indices: Indices = slice(None)) -> State:
        """A copy of the exact state of some rooms (all of them by default)."""
        return self.state[self._chosen(indices)]

    def set_state(self, state: State, indices: Indices = slice(None)) -> None:
        """Put rooms (all of them by default) into a state taken earlier, from this batch or another of its size.

        The state brings everything along: graph, step limit, whether keys can be dropped, and the seed and number of
        the room it was taken from, which fix the episodes that follow.

        Raises:
            InputError: if the state's grid size or number of rooms does not fit, or a room does not exist.
        """
        chosen = self._chosen(indices)
        if state.size != self.state.size or len(state) != len(chosen):
            raise InputError(
                f"the state must hold {len(chosen)} rooms of size {self.state.size}; "
                f"it holds {len(state)} of size {state.size}"
            )
        self.state.rooms[chosen], self.state.grids[chosen] = state.rooms, state.grids
        self._clear_outcomes(chosen, state.rooms["steps"])
        rooms = state.rooms
        at_exit = (rooms["row"] == rooms["exit_at"][:, 0]) & (rooms["col"] == rooms["exit_at"][:, 1])
        self.outcomes["terminated"][chosen] = rooms["is_over"] & at_exit
        self.outcomes["truncated"][chosen] = rooms["is_over"] & (rooms["steps"] >= rooms["max_steps"])
        kernels.look_rooms(self.state.rooms, self.state.grids, self.outcomes)

    def _chosen(self, indices: Indices) -> NDArray[np.integer]:
        try:
            return np.atleast_1d(np.arange(len(self))[indices])
        except IndexError as error:
            raise InputError(f"rooms are numbered from 0 to {len(self) - 1}; there is no {indices}") from error

    def _clear_outcomes(self, indices: NDArray[np.integer], lengths: ArrayLike) -> None:
        """As if the rooms had just come to where they are, without a step that could be told of."""
        outcomes = np.zeros(len(indices), OUTCOME)
        outcomes["event"], outcomes["length"] = -1, lengths
        self.outcomes[indices] = outcomes

    def _as_actions(self, actions: ArrayLike) -> NDArray[np.int64]:
        if isinstance(actions, np.ndarray) and actions.dtype is INT64 and actions.shape == self._shape:
            return actions if actions.flags.c_contiguous else actions.copy()
        given = np.asarray(actions)
        if given.shape != self._shape or given.dtype.kind not in "iu":
            raise InputError(
                f"actions must be {len(self)} whole numbers, one for each room, "
                f"not an array of {given.dtype} and shape {given.shape}"
            )
        return given.astype(np.int64)


@cache
def _compiled_step() -> Callable[..., None]:
    """`kernels.step_and_reset_rooms` for the types of a batch's arrays."""
    state = empty_state(1, MIN_SIZE)
    arrays = state.rooms, state.grids, np.zeros(1, GRAPH), np.zeros(1, INT64), np.zeros(1, OUTCOME), state.rooms
    return kernels.compiled(kernels.step_and_reset_rooms, *arrays)
