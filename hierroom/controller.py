"""The controller: what it observes, and how it is rewarded."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.env_config import NOVELTY_BONUS
from hierroom.errors import InputError
from hierroom.goals import GOAL_VECTORS, N_COLOURS
from hierroom.world.kernels import VIEW
from hierroom.world.tiles import encode


@dataclass(frozen=True)
class Observation:
    """What M environments show an agent at one moment: observations and the features of a network are made from it.

    Args:
        envs: [M] int, the environments' places in the batch.
        tiles: [M, 7, 7] uint8 tile codes of the view.
        levels: [M] records of `layout.LEVEL`.
        goals: [M] int, the goal ids pursued, or -1; for the meta-controller those it gave last.
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


@dataclass(frozen=True)
class Reward:
    """How the controller is rewarded.

    Args:
        rule: from the outcomes [N] of a step, whether the goal was reached [N] and the size of the novelty bonus to the
            rewards [N], float64.
        ends_with_option: whether the controller's return ends where its option ends, as no later reward depends on it.
        memories: what levels must remember for the rule, names in `layout.MEMORIES`.
        novelty_bonus: the reward for each novel state, where the rule rewards novelty.

    Raises:
        InputError: if the bonus is negative or not a number.
    """

    rule: Callable[[np.ndarray, NDArray[np.bool_], float], NDArray[np.float64]]
    ends_with_option: bool = False
    memories: tuple[str, ...] = ()
    novelty_bonus: float = NOVELTY_BONUS

    def __post_init__(self) -> None:
        if not 0 <= self.novelty_bonus < math.inf:
            raise InputError(f"novelty_bonus must be a number of at least 0, not {self.novelty_bonus!r}")

    def rewards(self, outcomes: np.ndarray, reached: NDArray[np.bool_]) -> NDArray[np.float64]:
        """[N] the controller's rewards for a step; arguments as in ``rule``."""
        return self.rule(outcomes, reached, self.novelty_bonus)


def _extrinsic(outcomes: np.ndarray, reached: NDArray[np.bool_], bonus: float) -> NDArray[np.float64]:
    return outcomes["reward"].copy()


def _bonus(outcomes: np.ndarray, reached: NDArray[np.bool_], bonus: float) -> NDArray[np.float64]:
    return outcomes["is_first"].astype(np.float64)


def _intrinsic(outcomes: np.ndarray, reached: NDArray[np.bool_], bonus: float) -> NDArray[np.float64]:
    return reached.astype(np.float64)


def _novelty(outcomes: np.ndarray, reached: NDArray[np.bool_], bonus: float) -> NDArray[np.float64]:
    return outcomes["reward"] + bonus * outcomes["is_novel"]


REWARDS: Mapping[str, Reward] = {
    "extrinsic": Reward(_extrinsic),
    "bonus": Reward(_bonus),
    "intrinsic": Reward(_intrinsic, ends_with_option=True),
    "novelty": Reward(_novelty, memories=("visited",)),
}
"""extrinsic: 1 at the exit; bonus: 1 for each key, door and the exit, once an episode; intrinsic: 1 where the given
goal is reached (`options.goal_reached`); novelty: 1 at the exit, and a bonus for each state (cell, keys found, doors
open) that is entered for the first time in the episode."""


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
