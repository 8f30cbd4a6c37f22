"""The controller: what it sees, when its goal is reached, how it is paid."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.errors import InputError
from hierroom.goals import GOAL_VECTORS, N_COLOURS, NO_GOAL
from hierroom.world.kernels import VIEW
from hierroom.world.tiles import encode


@dataclass(frozen=True)
class Sight:
    """What there is to be seen from M rooms, at one moment.

    Args:
        tiles: [M, 7, 7] uint8 tile codes of the view.
        rooms: [M] records of `layout.ROOM`.
        goals: [M] int, the goal ids pursued, or -1.
        previous_actions: [M] int, the controller's last action, or the number of actions before the first.
        outcomes: [M] int, how the last goal's life ended: ``NO_OUTCOME``, ``REACHED``, ``TIMED_OUT`` or ``OTHER``.
    """

    tiles: NDArray[np.uint8]
    rooms: np.ndarray
    goals: NDArray[np.integer]
    previous_actions: NDArray[np.integer]
    outcomes: NDArray[np.integer]


def goal_reached(outcomes: np.ndarray, goals: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Whether a step reached the goals that were pursued.

    'No goal' asks for something new: a key, door or exit that is achieved, or comes into view, for the first time this
    episode.

    Args:
        outcomes: [N] records of `layout.OUTCOME`, what came of the step.
        goals: [N] int, goal ids or -1.

    Returns:
        [N] bool.
    """
    is_new = outcomes["is_first"] | outcomes["is_discovery"]
    return np.where(goals == NO_GOAL, is_new, outcomes["event"] == goals)


NOVELTY_BONUS = 0.03
"""Size of the bonus for a novel state unless another is given. Leaving at once is certain to be worth more than the
states that are left up to (1 - gamma) / gamma, 0.053 at the default discount."""


@dataclass(frozen=True)
class Pay:
    """How the controller is paid.

    Args:
        rule: from the outcomes [N] of a step, whether the goal was reached [N] and the size of the novelty bonus to the
            rewards [N], float64.
        ends_with_goal: whether a return ends where its goal's life ends, because nothing after that pays for it.
        novelty_bonus: what a rule that pays for novelty pays for each novel state.

    Raises:
        InputError: if the bonus is negative or not a number.
    """

    rule: Callable[[np.ndarray, NDArray[np.bool_], float], NDArray[np.float64]]
    ends_with_goal: bool = False
    novelty_bonus: float = NOVELTY_BONUS

    def __post_init__(self) -> None:
        if not 0 <= self.novelty_bonus < math.inf:
            raise InputError(f"novelty_bonus must be a number of at least 0, not {self.novelty_bonus!r}")

    def rewards(self, outcomes: np.ndarray, reached: NDArray[np.bool_]) -> NDArray[np.float64]:
        """[N] what the controller is paid for a step; arguments as in ``rule``."""
        return self.rule(outcomes, reached, self.novelty_bonus)


PAYS: Mapping[str, Pay] = {
    "extrinsic": Pay(lambda outcomes, reached, bonus: outcomes["reward"].copy()),
    "bonus": Pay(lambda outcomes, reached, bonus: outcomes["is_first"].astype(np.float64)),
    "intrinsic": Pay(lambda outcomes, reached, bonus: reached.astype(np.float64), ends_with_goal=True),
    "novelty": Pay(lambda outcomes, reached, bonus: outcomes["reward"] + bonus * outcomes["is_novel"]),
}
"""extrinsic: 1 at the exit; bonus: 1 for each key, door and the exit, once an episode; intrinsic: 1 if `goal_reached`;
novelty: 1 at the exit, and a bonus for each state (cell, keys found, doors open) entered first in this episode."""


def observation_spaces(n_actions: int) -> dict[str, spaces.Space]:
    """The spaces of what an agent sees; `observe` fills them."""
    return {
        "observation": spaces.Box(0, 10, (VIEW, VIEW, 3), np.uint8),
        "goal": spaces.Box(0, 1, GOAL_VECTORS.shape[1:], np.float32),
        "direction": spaces.Discrete(4),
        "keys_held": spaces.Box(0, 1, (N_COLOURS,), np.int8),
        "doors_open": spaces.Box(0, 1, (N_COLOURS,), np.int8),
        "action_mask": spaces.Box(0, 1, (n_actions,), np.int8),
    }


def observe(sight: Sight, masks: NDArray[np.bool_]) -> dict[str, NDArray]:
    """The observations of M rooms, in fresh arrays.

    Args:
        sight: what there is to be seen.
        masks: [M, A] bool, the legal actions.

    Returns:
        ``observation`` [M, 7, 7, 3] uint8 as MiniGrid's ``image``: cell [i, j] is i - 3 cells to the agent's right and
        6 - j ahead; its channels are MiniGrid's object id, its colour id, and 1 for an open door. ``goal`` [M, 9]
        float32, one-hot object and colour, zero for no goal. ``direction`` [M] int64, 0 east, 1 south, 2 west, 3
        north. ``keys_held`` and ``doors_open`` [M, 6] int8 by colour, the keys held and the doors open. ``action_mask``
        [M, A] int8.
    """
    rooms = sight.rooms
    branches = rooms["branches"]
    return {
        "observation": encode(sight.tiles),
        "goal": GOAL_VECTORS[sight.goals],
        "direction": rooms["direction"].astype(np.int64),
        "keys_held": (rooms["keys"][:, None] >> branches & 1).astype(np.int8),
        "doors_open": (rooms["doors"][:, None] >> branches & 1).astype(np.int8),
        "action_mask": masks.astype(np.int8),
    }
