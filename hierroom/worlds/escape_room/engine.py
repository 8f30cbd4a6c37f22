"""N EscapeRoom environments stepped together."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.goals import GoalGraph
from hierroom.support.arrays import read_only
from hierroom.support.errors import InputError
from hierroom.support.kernel import Compiled
from hierroom.support.schema import Whole
from hierroom.support.thread_pool import Shares
from hierroom.worlds.env_config import SPLITS
from hierroom.worlds.escape_room import batch_kernels
from hierroom.worlds.escape_room.constants import MIN_SIZE
from hierroom.worlds.escape_room.layout import (
    GRAPH,
    LEVEL,
    MEMORIES,
    NO_MAPS,
    OUTCOME,
    Maps,
    State,
    empty_state,
    graph_records,
)
from hierroom.worlds.escape_room.state_check import check_state
from hierroom.worlds.seeds import Indices, chosen_envs, write_seeds
from hierroom.worlds.world import Seeds, whole_numbers


class Engine:
    """N environments that are stepped together; where an episode ends, the next one begins.

    The episodes of an environment are determined by ``(seed, index, episode)``, independent of the batch it belongs to
    and of the number of threads.

    Args:
        graphs: goal graphs; each episode samples one of them.
        maps: fixed levels to use instead of the graphs; each episode samples one of them.
        size: cells along a side of the grid, 11 to 63, outer walls included.
        max_steps: steps after which an episode is truncated.
        seed: 0 to 2**63 - 1; None generates no levels yet: call `reset` with a seed first.
        memories: names in `layout.MEMORIES` of what levels remember of their episode.
        levels: name in `env_config.SPLITS` of the set of levels to draw from; None: all.

    Attributes:
        state: the state of the environments, read-only, updated in place by each step.
        outcomes: [N] records of `layout.OUTCOME`, read-only, overwritten by each step.
        finals: [N] records of `layout.LEVEL`, read-only: each level at the end of its last episode.
    """

    def __init__(
        self,
        graphs: Sequence[GoalGraph],
        num_envs: int = 1,
        *,
        size: int = 19,
        max_steps: int = 1000,
        drop_key: bool = False,
        seed: int | None = 0,
        first_index: int = 0,
        threads: int = 1,
        memories: Iterable[str] = (),
        levels: str | None = None,
        maps: Maps = NO_MAPS,
    ):
        Whole(1, 2**31 - 1).check(max_steps, "max_steps")
        Whole(0, 2**62).check(first_index, "first_index")
        self._state, self._has_maps = empty_state(num_envs, size, maps), len(maps) > 0
        self.set_graphs(graphs)
        self._outcomes = np.zeros(num_envs, OUTCOME)
        self._finals = np.zeros(num_envs, LEVEL)
        records = self._state.levels
        records["index"], records["split"] = first_index + np.arange(num_envs), SPLITS[levels]
        records["max_steps"], records["can_drop"] = max_steps, drop_key
        self.n_actions, self.has_begun = 6 if drop_key else 5, False
        self._shares = Shares(num_envs, threads)
        self._show()
        self.remember(memories)
        if seed is not None:
            self.reset(seed)

    def _show(self) -> None:
        """Give users read-only views of the arrays, because kernels check no bounds."""
        self._step_all: Callable[[NDArray[np.int64]], None] | None = None  # made by the first step
        self.state = State(read_only(self._state.grids), read_only(self._state.levels), self._state.maps)
        self.outcomes, self.finals = read_only(self._outcomes), read_only(self._finals)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what `_show` makes, because a copy must view its own arrays."""
        shown = ("state", "outcomes", "finals", "_step_all")
        return {name: value for name, value in self.__dict__.items() if name not in shown}

    def __setstate__(self, copied: dict[str, Any]) -> None:
        self.__dict__.update(copied)
        self._show()

    def __len__(self) -> int:
        return len(self._outcomes)

    def reset(self, seed: Seeds = None, envs: Indices = slice(None)) -> None:
        """Begin the first episode of a seed (0 to 2**63 - 1), or without a seed the next one, in some environments.

        ``seed`` is one for all of them, or a sequence with a seed or None for each.
        """
        chosen, levels = chosen_envs(envs, len(self)), self._state.levels
        write_seeds(levels, seed, chosen)
        self._clear_outcomes(chosen, 0)
        self.has_begun = True
        begin = _BEGIN_OF_MAPS.run if self._has_maps else _BEGIN.run
        begin(levels, self._state.grids, *self._sources, self._outcomes, chosen)

    def remember(self, memories: Iterable[str]) -> None:
        """From the next `reset` on, let levels also remember these parts of their episode: see `layout.MEMORIES`."""
        for name in memories:
            if name not in MEMORIES:
                raise InputError(f"levels can remember {', '.join(MEMORIES)}, not {name!r}")
            self._state.levels["remembers"] |= MEMORIES[name]

    def stagger_clocks(self) -> None:
        """Spread the step counts of the current episodes evenly, so that they are not all truncated together."""
        levels = self._state.levels
        levels["steps"] = np.arange(len(self)) * levels["max_steps"] // len(self)

    def set_graphs(self, graphs: Sequence[GoalGraph]) -> None:
        """Set the goal graphs from which later episodes sample."""
        records, maps = graph_records(graphs), self._state.maps
        self._sources, self._step_all = (maps.levels, maps.grids) if self._has_maps else (records,), None

    def step(self, actions: ArrayLike) -> np.ndarray:
        """Take actions [N] and return the outcomes; an action that does not exist only costs the step."""
        return self.advance(whole_numbers(actions, len(self._outcomes)))

    def step_within_episode(self, actions: ArrayLike) -> np.ndarray:
        """Act once in every environment that has not ended and return the outcomes, without resets."""
        return self.advance_within_episode(whole_numbers(actions, len(self)))

    def advance(self, actions: NDArray[np.int64]) -> np.ndarray:
        """Do what `step` does, with checked actions."""
        if self._step_all is None:
            # Bind all but the actions once, because finding the arguments takes time at every step.
            levels, grids, outcomes, finals = self._state.levels, self._state.grids, self._outcomes, self._finals
            step, sources = _STEP_OF_MAPS.run if self._has_maps else _STEP.run, self._sources
            if self._shares.is_one:
                self._step_all = partial(step, levels, grids, *sources, outcomes, finals)
            else:
                self._step_all = lambda actions: self._shares.each(
                    lambda p: step(levels[p], grids[p], *sources, outcomes[p], finals[p], actions[p])
                )
        self._step_all(actions)
        return self._outcomes

    def advance_within_episode(self, actions: NDArray[np.int64]) -> np.ndarray:
        """Do what `step_within_episode` does, with checked actions."""
        _STEP_WITHIN.run(self._state.levels, self._state.grids, actions, self._outcomes)
        return self._outcomes

    def state_after(self, before: State, actions: NDArray[np.int64]) -> State:
        """Return the state after the last step; where it ended an episode, repeat it without a reset."""
        state = self.get_state()
        ended = np.flatnonzero(self._outcomes["terminated"] | self._outcomes["truncated"])
        if len(ended):
            last = before[ended]
            outcomes = np.zeros(len(ended), OUTCOME)
            batch_kernels.step_levels(last.levels, last.grids, actions[ended], outcomes)
            state.levels[ended], state.grids[ended] = last.levels, last.grids
        return state

    def get_state(self, envs: Indices = slice(None)) -> State:
        """Copy the exact state of some environments (by default all)."""
        return self._state[chosen_envs(envs, len(self))]

    def check_state(self, state: State, envs: Indices = slice(None)) -> None:
        """Check that a state is valid for `set_state`."""
        n_chosen = len(chosen_envs(envs, len(self)))
        check_state(state)
        if not state.maps.is_same(self._state.maps):
            raise InputError("the state is of other layouts than the environments have")
        if state.size != self._state.size or len(state) != n_chosen:
            raise InputError(
                f"the state must hold {n_chosen} environments of size {self._state.size}; "
                f"it holds {len(state)} of size {state.size}"
            )

    def set_state(self, state: State, envs: Indices = slice(None)) -> None:
        """Set environments (by default all) to a state taken earlier from these or other environments of the same size.

        The state includes the original environment's seed and index, which determine the episodes that follow.
        """
        self.check_state(state, envs)
        self._put(state, chosen_envs(envs, len(self)))

    def _put(self, state: State, chosen: NDArray[np.integer]) -> None:
        levels = state.levels
        self._state.levels[chosen], self._state.grids[chosen] = levels, state.grids
        self.has_begun = bool(self._state.levels["n_rooms"][0])
        self._clear_outcomes(chosen, levels["steps"])
        at_exit = (levels["row"] == levels["exit_at"][:, 0]) & (levels["col"] == levels["exit_at"][:, 1])
        self._outcomes["terminated"][chosen] = levels["has_ended"] & at_exit
        self._outcomes["truncated"][chosen] = levels["has_ended"] & (levels["steps"] >= levels["max_steps"])
        batch_kernels.look_levels(self._state.levels, self._state.grids, self._outcomes, chosen)

    def _clear_outcomes(self, envs: NDArray[np.integer], lengths: ArrayLike) -> None:
        outcomes = np.zeros(len(envs), OUTCOME)
        outcomes["length"] = lengths
        self._outcomes.put(envs, outcomes)  # an assignment would copy field by field


_STATE, _OUTCOMES, _NUMBERS = empty_state(1, MIN_SIZE), np.zeros(1, OUTCOME), np.zeros(1, np.int64)
_ARRAYS, _GRAPHS, _MAPS = (_STATE.levels, _STATE.grids), (np.zeros(1, GRAPH),), (NO_MAPS.levels, NO_MAPS.grids)
_BEGIN = Compiled(batch_kernels.reset_levels, *_ARRAYS, *_GRAPHS, _OUTCOMES, _NUMBERS)
_BEGIN_OF_MAPS = Compiled(batch_kernels.reset_levels_of_maps, *_ARRAYS, *_MAPS, _OUTCOMES, _NUMBERS)
_CHANGED = _OUTCOMES, _STATE.levels, _NUMBERS
_STEP = Compiled(batch_kernels.step_and_reset_levels, *_ARRAYS, *_GRAPHS, *_CHANGED)
_STEP_OF_MAPS = Compiled(batch_kernels.step_and_reset_levels_of_maps, *_ARRAYS, *_MAPS, *_CHANGED)
_STEP_WITHIN = Compiled(batch_kernels.step_levels, *_ARRAYS, _NUMBERS, _OUTCOMES)
