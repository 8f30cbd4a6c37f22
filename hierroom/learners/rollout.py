"""Storage of turns until an update: a pool of columns ``[T, C]``, each a sequence of one environment's turns.

A full column waits for the update. The environment's next turn opens another column, with the recurrent state at that
moment as its initial state.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from hierroom.support.errors import InputError


@dataclass(frozen=True)
class Batch:
    """Full sequences of turns: T turns by M sequences, all floats float32."""

    initial_states: NDArray[np.float32]  # [M, S] before turn 0
    spans_update: NDArray[np.bool_]  # [M] whether there was an update after turn 0 began
    features: NDArray[np.uint8]  # [T, M, K] the observations
    masks: NDArray[np.bool_]  # [T, M, A] the legal actions
    resets: NDArray[np.bool_]  # [T, M] whether the turn begins an episode
    actions: NDArray  # [T, M, ...] as the policy drew them
    log_probs: NDArray[np.float32]  # [T, M] log-probabilities of the actions when they were taken
    values: NDArray[np.float32]  # [T, M]
    rewards: NDArray[np.float32]  # [T, M]
    elapsed: NDArray[np.int64]  # [T, M] number of primitive steps of the turn
    terminated: NDArray[np.bool_]  # [T, M]
    truncated: NDArray[np.bool_]  # [T, M]
    next_values: NDArray[np.float32]  # [T, M] zero where terminated

    def single_turns(self, *others: NDArray) -> tuple[Any, ...]:
        """Return the T M turns as sequences of one turn each, and other arrays [T, M] in the same form [1, T M]."""
        length, n = len(self.rewards), self.rewards.size
        turns = {
            name: np.concatenate([array] * length) if name in _BY_SEQUENCE else array.reshape(1, n, *array.shape[2:])
            for name, array in vars(self).items()
        }
        return Batch(**turns), *(array.reshape(1, -1) for array in others)


MOST_BYTES = 2**30
"""Most memory of the stored turns. Each checkpoint of a run has a copy."""
_BYTES_OF_TURN = 27  # without features, masks and actions
_NUMBER = np.zeros((), np.int64)
_BY_SEQUENCE = ("initial_states", "spans_update")  # entries of a `Batch` per sequence; the others are per turn


class Rollout:
    """A pool of ``capacity`` columns of ``length`` turns, and the column that each environment is writing."""

    def __init__(
        self,
        num_envs: int,
        length: int,
        capacity: int,
        n_features: int,
        n_actions: int,  # columns of masks
        state_size: int,
        action: NDArray = _NUMBER,  # an example
    ) -> None:
        if (n := length * capacity * (n_features + n_actions + action.nbytes + _BYTES_OF_TURN)) > MOST_BYTES:
            turns = f"{capacity:,} sequences of {length:,} turns with {n_features:,} bytes of features each"
            raise InputError(
                f"{turns} need {n / 1e6:,.0f} MB, and at most {MOST_BYTES / 1e6:,.0f} MB are allowed: lower num_envs, "
                "sequence_length or sequences_per_update, or show less"
            )
        self.length = length
        self.slots = Batch(
            initial_states=np.zeros((capacity, state_size), np.float32),
            spans_update=np.zeros(capacity, bool),
            features=np.zeros((length, capacity, n_features), np.uint8),
            masks=np.zeros((length, capacity, n_actions), bool),
            resets=np.zeros((length, capacity), bool),
            actions=np.zeros((length, capacity, *action.shape), action.dtype),
            log_probs=np.zeros((length, capacity), np.float32),
            values=np.zeros((length, capacity), np.float32),
            rewards=np.zeros((length, capacity), np.float32),
            elapsed=np.ones((length, capacity), np.int64),
            terminated=np.zeros((length, capacity), bool),
            truncated=np.zeros((length, capacity), bool),
            next_values=np.zeros((length, capacity), np.float32),
        )
        self.columns = np.full(num_envs, -1)  # [N] the column that the environment is writing, or -1
        self.turns = np.zeros(num_envs, np.int64)  # [N] number of finished turns in that column
        self.is_open = np.zeros(num_envs, bool)  # [N] whether a turn has begun that has not finished
        self.awaiting = np.full(num_envs, -1)  # [N] the full column that needs the value of the next turn, or -1
        self._free = list(range(capacity))
        self.full: list[int] = []  # the columns that wait for an update, oldest first

    def begin(
        self,
        envs: NDArray[np.integer],  # [M]
        states: NDArray[np.float32],  # [M, S] the recurrent states before the turn
        values: NDArray[np.float32],  # [M]
        **turn: NDArray,  # [M, ...] the resets, features, masks, actions and log_probs, as in `Batch`
    ) -> None:
        """Open a turn in each of ``envs``."""
        starting = np.flatnonzero(self.columns[envs] < 0)
        if len(starting):
            if len(starting) > len(self._free):
                raise RuntimeError("every sequence is full: the learner was ready but update() was not called")
            self.columns[envs[starting]] = [self._free.pop(0) for _ in starting]
            self.slots.initial_states[self.columns[envs[starting]]] = states[starting]
            self.slots.spans_update[self.columns[envs[starting]]] = False
        columns, turns, slots = self.columns[envs], self.turns[envs], self.slots
        slots.values[turns, columns] = values
        for name, entries in turn.items():
            getattr(slots, name)[turns, columns] = entries
        # The value of this observation bootstraps the previous turn, unless its return ended there.
        before = turns - 1
        follows = (turns > 0) & ~(slots.terminated[before, columns] | slots.truncated[before, columns])
        slots.next_values[before[follows], columns[follows]] = values[follows]
        self.bootstrap(envs, values)
        self.is_open[envs] = True

    def bootstrap(self, envs: NDArray[np.integer], values: NDArray[np.float32]) -> None:
        """Store the values [M] of the next turns of ``envs`` [M] in the full columns that wait for them."""
        columns = self.awaiting[envs]
        lacking = columns >= 0
        self.slots.next_values[-1, columns[lacking]] = values[lacking]
        self.awaiting[envs] = -1

    def finish(
        self,
        envs: NDArray[np.integer],
        rewards: NDArray[np.floating],
        elapsed: NDArray[np.integer],
        terminated: NDArray[np.bool_],
        truncated: NDArray[np.bool_],
        next_values: NDArray[np.float32],
    ) -> None:
        """Close the open turns of ``envs`` [M]; ``next_values`` [M] bootstrap truncated ones and are 0 elsewhere."""
        columns, turns, slots = self.columns[envs], self.turns[envs], self.slots
        with np.errstate(over="ignore"):  # a reward beyond float32 becomes infinite, which the update then reports
            slots.rewards[turns, columns] = rewards
        slots.elapsed[turns, columns] = elapsed
        slots.terminated[turns, columns] = terminated
        slots.truncated[turns, columns] = truncated
        slots.next_values[turns, columns] = next_values
        self.is_open[envs] = False
        self.turns[envs] = turns + 1
        is_full = turns + 1 == self.length
        full, goes_on = envs[is_full], ~(terminated | truncated)[is_full]
        self.full.extend(self.columns[full].tolist())
        self.awaiting[full[goes_on]] = self.columns[full[goes_on]]
        self.columns[full] = -1
        self.turns[full] = 0

    def take(self) -> Batch:
        """Copy all full sequences for an update, oldest first, and free their columns."""
        taken, self.full = self.full, []
        self._free.extend(taken)
        slots = vars(self.slots).items()
        batch = Batch(**{name: a.take(taken, axis=0 if name in _BY_SEQUENCE else 1) for name, a in slots})
        self.slots.spans_update[self.columns[self.columns >= 0]] = True
        return batch

    def state_dict(self) -> dict:
        """Return the complete state as tensors and lists, open turns and partly filled sequences included."""
        arrays = {name: torch.from_numpy(array.copy()) for name, array in self._arrays().items()}
        return {"arrays": arrays, "free": list(self._free), "full": list(self.full)}

    def load_state_dict(self, state: dict) -> None:
        """Restore what `state_dict` returned."""
        for name, array in self._arrays().items():
            array[...] = state["arrays"][name].numpy()
        self._free, self.full = list(state["free"]), list(state["full"])

    def _arrays(self) -> dict[str, NDArray]:
        of_envs = {name: getattr(self, name) for name in ("columns", "turns", "is_open", "awaiting")}
        return {**vars(self.slots), **of_envs}
