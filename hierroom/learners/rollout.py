"""Where finished turns wait for an update: sequences of each environment's own turns.

An environment in which the agent acts rarely fills its sequence slowly; there is no row for a step at which it waited.
The store is a pool of columns ``[T, C]``. The turns of each environment go into one column; a column with T finished
turns is full and waits for the update, and the next turn opens another one, whose initial state is the recurrent state
at that moment.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray


@dataclass(frozen=True)
class Batch:
    """Full sequences of turns, T turns by M sequences. All floats are float32."""

    initial_states: NDArray[np.float32]  # [M, S] before turn 0
    features: NDArray[np.uint8]  # [T, M, K] what the agent saw
    masks: NDArray[np.bool_]  # [T, M, A] what it was allowed to do
    resets: NDArray[np.bool_]  # [T, M] this turn begins an episode
    actions: NDArray[np.int64]  # [T, M]
    log_probs: NDArray[np.float32]  # [T, M] of the actions, when they were taken
    values: NDArray[np.float32]  # [T, M]
    rewards: NDArray[np.float32]  # [T, M]
    elapsed: NDArray[np.int64]  # [T, M] primitive steps the turn lasted
    terminated: NDArray[np.bool_]  # [T, M]
    truncated: NDArray[np.bool_]  # [T, M]
    next_values: NDArray[np.float32]  # [T, M] zero where terminated
    hindsight_actions: NDArray[np.int64]  # [T, M] the other action whose effect the turn had, or -1
    hindsight_log_probs: NDArray[np.float32]  # [T, M] of those, when the actions were taken


class Rollout:
    """The pool of columns and who writes where.

    Args:
        num_envs: environments N, each with at most one turn open.
        length: turns T in a sequence.
        capacity: columns C, at least N.
        n_features: entries K of an observation.
        n_actions: actions A.
        state_size: entries S of a recurrent state.
    """

    def __init__(
        self, num_envs: int, length: int, capacity: int, n_features: int, n_actions: int, state_size: int
    ) -> None:
        self.length = length
        self.slots = Batch(
            initial_states=np.zeros((capacity, state_size), np.float32),
            features=np.zeros((length, capacity, n_features), np.uint8),
            masks=np.zeros((length, capacity, n_actions), bool),
            resets=np.zeros((length, capacity), bool),
            actions=np.zeros((length, capacity), np.int64),
            log_probs=np.zeros((length, capacity), np.float32),
            values=np.zeros((length, capacity), np.float32),
            rewards=np.zeros((length, capacity), np.float32),
            elapsed=np.ones((length, capacity), np.int64),
            terminated=np.zeros((length, capacity), bool),
            truncated=np.zeros((length, capacity), bool),
            next_values=np.zeros((length, capacity), np.float32),
            hindsight_actions=np.full((length, capacity), -1),
            hindsight_log_probs=np.zeros((length, capacity), np.float32),
        )
        self.columns = np.full(num_envs, -1)  # [N] the column an environment writes, -1: none yet
        self.turns = np.zeros(num_envs, np.int64)  # [N] finished turns in that column
        self.is_open = np.zeros(num_envs, bool)  # [N] a turn has begun and not finished
        self.awaiting = np.full(num_envs, -1)  # [N] the full column that lacks the value of the next turn, -1: none
        self._free = list(range(capacity))
        self._full: list[int] = []

    @property
    def n_full(self) -> int:
        """Sequences that wait for an update."""
        return len(self._full)

    @property
    def n_bytes(self) -> int:
        """Memory the pool takes, in bytes; it never grows."""
        return sum(array.nbytes for array in vars(self.slots).values())

    def begin(
        self,
        envs: NDArray[np.integer],
        states: NDArray[np.float32],
        resets: NDArray[np.bool_],
        features: NDArray[np.uint8],
        masks: NDArray[np.bool_],
        actions: NDArray[np.int64],
        log_probs: NDArray[np.float32],
        values: NDArray[np.float32],
    ) -> None:
        """Open a turn in each of ``envs`` [M]; ``states`` [M, S] are those before the turn, the rest as in `Batch`."""
        starting = np.flatnonzero(self.columns[envs] < 0)
        if len(starting):
            if len(starting) > len(self._free):
                raise RuntimeError("every sequence is full: the learner was ready but update() was not called")
            self.columns[envs[starting]] = [self._free.pop(0) for _ in starting]
            self.slots.initial_states[self.columns[envs[starting]]] = states[starting]
        columns, turns = self.columns[envs], self.turns[envs]
        slots = self.slots
        slots.resets[turns, columns] = resets
        slots.features[turns, columns] = features
        slots.masks[turns, columns] = masks
        slots.actions[turns, columns] = actions
        slots.log_probs[turns, columns] = log_probs
        slots.hindsight_actions[turns, columns] = -1
        slots.values[turns, columns] = values
        # The value of this observation is what the turn before was waiting for, unless its return ended there.
        before = turns - 1
        follows = (turns > 0) & ~(slots.terminated[before, columns] | slots.truncated[before, columns])
        slots.next_values[before[follows], columns[follows]] = values[follows]
        self.bootstrap(envs, values)
        self.is_open[envs] = True

    def relabel(self, envs: NDArray[np.integer], actions: NDArray[np.integer], log_probs: NDArray[np.float32]) -> None:
        """Note the other actions [M] whose effect the open turns of ``envs`` [M] had, and their log-probabilities."""
        columns, turns = self.columns[envs], self.turns[envs]
        self.slots.hindsight_actions[turns, columns] = actions
        self.slots.hindsight_log_probs[turns, columns] = log_probs

    def masks(self, envs: NDArray[np.integer]) -> NDArray[np.bool_]:
        """The legal actions [M, A] of the open turns of ``envs`` [M]."""
        return self.slots.masks[self.turns[envs], self.columns[envs]]

    def bootstrap(self, envs: NDArray[np.integer], values: NDArray[np.float32]) -> None:
        """Give the full columns of ``envs`` [M] that lack it the value [M] of the turn that follows."""
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
        """Close the open turn of each of ``envs`` [M].

        ``next_values`` [M] are those of truncated turns; elsewhere they must be zero. A column that this fills joins
        the queue, in the order of ``envs``; where its return goes on, it lacks a value until `bootstrap` or `begin`.
        """
        columns, turns = self.columns[envs], self.turns[envs]
        slots = self.slots
        slots.rewards[turns, columns] = rewards
        slots.elapsed[turns, columns] = elapsed
        slots.terminated[turns, columns] = terminated
        slots.truncated[turns, columns] = truncated
        slots.next_values[turns, columns] = next_values
        self.is_open[envs] = False
        self.turns[envs] = turns + 1
        is_full = turns + 1 == self.length
        full, goes_on = envs[is_full], ~(terminated | truncated)[is_full]
        self._full.extend(self.columns[full].tolist())
        self.awaiting[full[goes_on]] = self.columns[full[goes_on]]
        self.columns[full] = -1
        self.turns[full] = 0

    def take(self) -> Batch:
        """Copies of all full sequences, the longest waiting first; their columns are free again."""
        taken, self._full = self._full, []
        self._free.extend(taken)
        slots = vars(self.slots).items()
        return Batch(**{name: a.take(taken, axis=0 if name == "initial_states" else 1) for name, a in slots})

    def state_dict(self) -> dict:
        """Everything, open turns and partly filled sequences included, as tensors and lists."""
        arrays = {name: torch.from_numpy(array.copy()) for name, array in self._arrays().items()}
        return {"arrays": arrays, "free": list(self._free), "full": list(self._full)}

    def load_state_dict(self, state: dict) -> None:
        """Restore what `state_dict` gave."""
        for name, array in self._arrays().items():
            array[...] = state["arrays"][name].numpy()
        self._free, self._full = list(state["free"]), list(state["full"])

    def _arrays(self) -> dict[str, NDArray]:
        return {
            **vars(self.slots),
            "columns": self.columns,
            "turns": self.turns,
            "is_open": self.is_open,
            "awaiting": self.awaiting,
        }
