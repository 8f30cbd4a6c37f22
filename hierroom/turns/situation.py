"""The situation in which a meta-controller chooses goals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierroom.controller import Observation
from hierroom.goals import NO_GOAL
from hierroom.support.errors import InputError


@dataclass(frozen=True)
class Situation(Observation):
    """A meta-controller's `Observation` of M environments, with their exact state in the view.

    ``goals`` are the goals of its last ended options; ``masks`` [M, G + 1] are its legal choices, 'no goal' last.

    Args:
        meta_turns: [M] int, turns it has taken this episode.
        uniforms: [M, G + 1] float in [0, 1), random numbers for this turn, one for each goal and one for no goal. They
            depend only on seed, environment, episode and turn, so a choice made with them is the same in any batch.
    """

    meta_turns: NDArray[np.integer]
    uniforms: NDArray[np.float64]

    def as_dict(self) -> dict[str, NDArray]:
        """Return `Observation.as_dict` and ``outcome`` [M] int64, how the last option ended."""
        return {**super().as_dict(), "outcome": self.outcomes.astype(np.int64)}

    @property
    def legal(self) -> NDArray[np.bool_]:
        """Goals that may be chosen, [M, G] bool; a row may be all False."""
        return self.masks[:, :-1]

    def level(self, m: int) -> Any:
        """Return the m-th environment in words, as the world describes it."""
        return self.view.level(m, self.legal[m])

    def validate_goals(self, actions: ArrayLike) -> tuple[NDArray[np.integer], NDArray[np.bool_]]:
        """Return the goals [M] of actions [M], and whether each action is legal [M].

        Actions are goal ids, or no goal (G or -1). The goal of an illegal action is -1.
        """
        no_goal_action = self.goal_set.no_goal_action
        try:
            given = np.asarray(actions)
        except ValueError:  # rows of unequal lengths
            given = np.array(None)
        if given.shape != self.envs.shape or given.dtype.kind not in "iu":
            raise InputError(
                f"the meta-controller's choice must be {len(self)} goal ids (whole numbers, one for each environment "
                f"that asks), not an array of {given.dtype} and shape {given.shape}"
            )
        in_range = (given >= NO_GOAL) & (given <= no_goal_action)
        choices = np.where(in_range, given, no_goal_action).astype(np.int64)  # unsigned types cannot hold -1
        choices[choices == NO_GOAL] = no_goal_action
        is_legal = in_range & self.masks[np.arange(len(self)), choices]
        return np.where(is_legal & (choices < no_goal_action), choices, NO_GOAL), is_legal
