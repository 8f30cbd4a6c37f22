"""What one primitive step did."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

N_OUTCOMES = 4
NO_OUTCOME, REACHED, TIMED_OUT, OTHER = range(N_OUTCOMES)
"""How a goal's life ended: there was none; reached; its horizon ran out; the episode ended."""


@dataclass(frozen=True)
class Step:
    """What one primitive step did in N rooms, in arrays that nobody else holds.

    Args:
        actions: [N] int, the controller's actions.
        goals: [N] int, the goal ids pursued, or -1.
        events: [N] int, the goal ids achieved, or -1.
        rewards: [N] float64, the controller's pay.
        extrinsic: [N] float64, the environment's own reward.
        reached: [N] bool, the goal was reached.
        timed_out: [N] bool, the goal's horizon ran out before it was reached or the episode ended.
        option_over: [N] bool, the goal's life is over for whatever reason: the meta-controller's turn ends here.
        meta_rewards: [N] float64, where the option is over the extrinsic reward summed over its life, else 0.
        meta_elapsed: [N] int, primitive steps since the meta-controller's last turn, this one included.
        terminated: [N] bool, the exit was reached.
        truncated: [N] bool, the time limit was reached.
        lengths: [N] int, steps of the episode so far.
        shortest: [N] int, the shortest possible length of the episode, or -1 where that is not measured.
        illegal_actions: [N] int, actions of the controller this episode that are none of the room's.
    """

    actions: NDArray[np.integer]
    goals: NDArray[np.integer]
    events: NDArray[np.integer]
    rewards: NDArray[np.float64]
    extrinsic: NDArray[np.float64]
    reached: NDArray[np.bool_]
    timed_out: NDArray[np.bool_]
    option_over: NDArray[np.bool_]
    meta_rewards: NDArray[np.float64]
    meta_elapsed: NDArray[np.integer]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    lengths: NDArray[np.integer]
    shortest: NDArray[np.integer]
    illegal_actions: NDArray[np.integer]

    @property
    def over(self) -> NDArray[np.bool_]:
        """[N] bool, the episode ended."""
        return self.terminated | self.truncated

    @property
    def outcomes(self) -> NDArray[np.integer]:
        """[N] int, where the option is over how it ended: ``REACHED``, ``TIMED_OUT`` or ``OTHER``."""
        return np.where(self.reached, REACHED, np.where(self.timed_out, TIMED_OUT, OTHER))
