"""The controller: what it observes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.goals import GOAL_VECTORS, N_COLOURS
from hierroom.worlds.escape_room.constants import VIEW
from hierroom.worlds.escape_room.tiles import encode


@dataclass(frozen=True)
class Observation:
    """What M environments show an agent at one moment: observations and the features of a network are made from it.

    Args:
        envs: [M] int, the environments' places in the batch.
        tiles: [M, 7, 7] uint8 tile codes of the view.
        levels: [M] records of `layout.LEVEL`.
        goals: [M] int, the goal ids pursued, or -1; for the meta-controller those of its last options that ended.
        previous_actions: [M] int, the controller's last action; the number of actions before the first, and where it
            was none of them.
        outcomes: [M] int, how the last option ended: ``NO_OUTCOME``, ``REACHED``, ``TIMED_OUT`` or ``OTHER``.
        masks: [M, A] bool, the legal actions of the agent.
    """

    envs: NDArray[np.integer]
    tiles: NDArray[np.uint8]
    levels: np.ndarray
    goals: NDArray[np.integer]
    previous_actions: NDArray[np.integer]
    outcomes: NDArray[np.integer]
    masks: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.envs)

    def as_dict(self) -> dict[str, NDArray]:
        """The observations of the environments as PettingZoo's and Gymnasium's users get them, in fresh arrays.

        Returns:
            ``observation`` [M, 7, 7, 3] uint8 as MiniGrid's ``image``: cell [i, j] is i - 3 cells to the agent's right
            and 6 - j ahead; its channels are MiniGrid's object id, its colour id, and 1 for an open door. ``goal``
            [M, 9] float32, one-hot object and colour, zero for no goal. ``direction`` [M] int64, 0 east, 1 south, 2
            west, 3 north. ``keys_held`` and ``doors_open`` [M, 6] int8 by colour, the keys held and the doors open.
            ``action_mask`` [M, A] int8.
        """
        levels, branches = self.levels, self.levels["branches"]
        return {
            "observation": encode(self.tiles),
            "goal": GOAL_VECTORS[self.goals],
            "direction": levels["direction"].astype(np.int64),
            "keys_held": (levels["keys"][:, None] >> branches & 1).astype(np.int8),
            "doors_open": (levels["doors"][:, None] >> branches & 1).astype(np.int8),
            "action_mask": self.masks.astype(np.int8),
        }


def observation_spaces(n_actions: int) -> dict[str, spaces.Space]:
    """The spaces of the entries of `Observation.as_dict`, for an agent with so many actions."""
    return {
        "observation": spaces.Box(0, 10, (VIEW, VIEW, 3), np.uint8),
        "goal": spaces.Box(0, 1, GOAL_VECTORS.shape[1:], np.float32),
        "direction": spaces.Discrete(4),
        "keys_held": spaces.Box(0, 1, (N_COLOURS,), np.int8),
        "doors_open": spaces.Box(0, 1, (N_COLOURS,), np.int8),
        "action_mask": spaces.Box(0, 1, (n_actions,), np.int8),
    }
