"""N environments of a task that come as a vector environment, as a world."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from hierroom.support.errors import InputError
from hierroom.support.kernel import Compiled
from hierroom.support.schema import Array, Table
from hierroom.worlds.base import BaseWorld
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.outcome_kernel import count_gains
from hierroom.worlds.task.parts import TaskParts
from hierroom.worlds.task.replayer import seeds_of
from hierroom.worlds.task.vector_envs import Seen, VectorEnvs
from hierroom.worlds.task.world import TaskWorld
from hierroom.worlds.window import StateScreen


class VectorWorld(TaskWorld):
    """N environments of a task that come as one vector environment.

    The vector is reset with the seed of environment 0's episode; all later episodes come from its own random numbers,
    so they depend on N. A resumed run begins new ones.

    In mode ``NEXT_STEP`` a vector that cannot reset single environments begins an episode only in the next step. So an
    episode's first step then does nothing, and its first observation is the last one of the episode before.
    """

    most_remembered = 0

    def __init__(self, task: TaskParts, config: EnvConfig, num_envs: int, **settings: Any) -> None:
        self._is_over, self._has_left, self._begins = np.zeros((3, num_envs), bool)
        """[N] whether the vector ended the episode in its last step, or did since the world began its own, and whether
        it begins the next one in its next step."""
        super().__init__(task, config, num_envs, **settings)

    def _make_envs(self, num_envs: int, render_mode: str | None = None) -> Any:
        self._vector = VectorEnvs(self.task, num_envs)
        return self._vector

    def screen(self, render_mode: str | None) -> StateScreen:
        """Refuse pictures."""
        if render_mode in ("rgb_array", "human"):
            self.task.new_env()  # raises an error
        return super().screen(render_mode)

    def stagger_clocks(self) -> None:
        """Spread the steps of the current episodes evenly, if each can be truncated alone."""
        if self._vector.can_reset:
            super().stagger_clocks()

    def begin(self, envs: NDArray[np.integer]) -> None:
        """Begin the episodes of environments [M], or take over those that the vector has begun."""
        vector, begun = self._vector, envs
        if len(envs) == len(self):
            self._now, self._begins[:] = vector.reset(seeds_of(self._episodes[:1], self.config.levels)[0]), False
            self._note_rows(self._now, slice(None))
        else:
            begins_itself = vector.mode is AutoresetMode.SAME_STEP
            has_begun = self._is_over if begins_itself else self._has_left & (not vector.can_reset)
            is_fresh = ~has_begun[envs]
            if np.count_nonzero(is_fresh):
                if not vector.can_reset:
                    why = "a reset, the target or max_steps ends an episode that it goes on with"
                    what = "use one that takes the option reset_mask, such as SyncVectorEnv, or mode DISABLED"
                    raise InputError(f"the vector of {self.task.name} resets no single environments, and {why}: {what}")
                where, begun = np.zeros(len(self), bool), envs[~is_fresh]
                where[envs[is_fresh]] = True
                self._note_rows(vector.reset(None, where), envs[is_fresh])
            if begins_itself:
                self._note_rows(self._now, begun)
            else:
                begins = begun[self._is_over[begun]]  # in other steps than that of the end, it has begun
                self._begins[begins], self._totals[begins] = True, 0
        self._is_over[envs], self._has_left[envs], self._cut[envs] = False, False, False

    def _note_rows(self, seen: Seen, where: NDArray[np.integer] | slice) -> None:
        for name, values in seen.entries.items():
            self._shown[name][where] = values[where]
        self._totals[where] = seen.totals[where]
        if seen.masks is not None:
            self._note_masks(where, seen.masks[where], ended=False)

    def step(self, actions: NDArray) -> np.ndarray:
        """Act once in every environment; all actions must exist."""
        if np.count_nonzero(self.actions.are_legal(actions)) < len(actions):
            which = f"{self.actions.new_space()}{' and legal' * (self.action_masks is not None)}"
            raise InputError(f"actions of {self.task.name}, a vector, must all be in {which}")
        vector = self._vector
        if vector.mode is AutoresetMode.DISABLED and np.count_nonzero(self._is_over):
            vector.reset(None, self._is_over)  # nobody looks at these episodes, which had ended for the world, too
        taken = vector.step(getattr(self.actions, "first", 0) + actions)
        times = np.empty_like(self._totals)
        _GAINS.run(self._totals, taken.last.totals, self._begins, times)
        for name, values in taken.last.entries.items():
            self._shown[name][...] = values
        if taken.last.masks is not None:
            self._note_masks(slice(None), taken.last.masks, self._have_ended(taken, times) | self._has_ended)
        if self.dependencies is not None and np.count_nonzero(self._begins):
            self._markings[self._begins] = self.dependencies.at_start(self._totals[self._begins])
        self._begins[:] = False
        self._now, self._is_over = taken.now, taken.terminated | taken.truncated
        self._has_left |= self._is_over
        outcomes = self.record(times, taken.rewards, taken.terminated, taken.truncated | self._cut)
        if taken.elapsed is not None:
            outcomes["elapsed"] = taken.elapsed
        return outcomes

    def get_arrays(self, envs: NDArray[np.integer]) -> dict[str, np.ndarray]:
        """Return everything that changes in environments [M] except for the vector itself, as fresh arrays."""
        return {**BaseWorld.get_arrays(self, envs), "cut": self._cut[envs]}

    def set_arrays(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Check and restore arrays that `get_arrays` returned, and begin new episodes after the next step."""
        Table({"cut": Array(np.bool_, (len(self),))}, is_open=True).check(arrays, "world")
        BaseWorld.set_arrays(self, arrays)
        self.begin(self.everywhere)
        self._cut[:] = True
        self.notes = [*self.notes, f"all episodes of {self.variants[0]} begin anew: a vector cannot continue them"]


_TOTALS = np.zeros((1, 1), np.int64)
_GAINS = Compiled(count_gains, _TOTALS, _TOTALS, np.zeros(1, bool), _TOTALS)
