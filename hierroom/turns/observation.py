"""What the two agents observe of environments, and what a meta-controller may know besides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from hierroom.goals import NO_GOAL
from hierroom.goals.goal_set import GoalSet
from hierroom.support.errors import InputError


@dataclass(frozen=True)
class Observation:
    """What M environments show an agent at one moment: observations and the features of a network are made from it.

    Attributes of the view can be read directly: ``observation.levels`` is ``observation.view.levels``.

    Args:
        envs: [M] int, the environments' places in the batch.
        view: what the world shows, a `worlds.world.View`.
        goal_set: the goals of the world.
        goals: [M] int, the goals pursued, or -1; for the meta-controller those of its last options that ended.
        previous_actions: [M] int, the controller's last action; the number of actions before the first, and where it
            was none of them.
        outcomes: [M] int, how the last option ended: ``NO_OUTCOME``, ``REACHED``, ``TIMED_OUT`` or ``OTHER``.
        masks: [M, A] bool, the legal actions of the agent.
    """

    envs: NDArray[np.integer]
    view: Any
    goal_set: GoalSet
    goals: NDArray[np.integer]
    previous_actions: NDArray[np.integer]
    outcomes: NDArray[np.integer]
    masks: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.envs)

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of the view."""
        if name.startswith("__") or name == "view":
            raise AttributeError(name)
        try:
            return getattr(self.view, name)
        except AttributeError:
            raise AttributeError(
                f"{name!r} is neither of every {type(self).__name__.lower()} nor of this world's"
            ) from None

    def as_dict(self) -> dict[str, NDArray]:
        """Return the observations as PettingZoo's and Gymnasium's users get them, in fresh arrays.

        They are the entries of the world (an EscapeRoom's: `level_view.LevelView.as_dict`), ``goal`` [M, K] float32,
        the goal's vector, and ``action_mask`` [M, A] int8.
        """
        return {
            **self.view.as_dict(),
            "goal": self.goal_set.vectors[self.goals],
            "action_mask": self.masks.astype(np.int8),
        }


def observation_spaces(world: dict[str, spaces.Space], goals: GoalSet, n_actions: int) -> dict[str, spaces.Space]:
    """Return the spaces of the entries of `Observation.as_dict`, of which ``world`` has the world's own."""
    return {
        **world,
        "goal": spaces.Box(0, 1, goals.vectors.shape[1:], np.float32),
        "action_mask": spaces.Box(0, 1, (n_actions,), np.int8),
    }


@dataclass(frozen=True)
class Situation(Observation):
    """What a meta-controller may know of M environments: an `Observation`, and their exact state in the view.

    ``goals`` are those of its last options that ended; ``masks`` [M, G + 1] the legal choices, 'no goal' the last.

    Args:
        meta_turns: [M] int, turns it has taken this episode.
        uniforms: [M, G + 1] float in [0, 1), random numbers for this turn, one for each goal and one for no goal. They
            are fixed by seed, environment, episode and turn: a choice made with them is the same in whatever batch.
    """

    meta_turns: NDArray[np.integer]
    uniforms: NDArray[np.float64]

    def as_dict(self) -> dict[str, NDArray]:
        """Return the entries of `Observation.as_dict`, and ``outcome`` [M] int64: how the last option ended."""
        return {**super().as_dict(), "outcome": self.outcomes.astype(np.int64)}

    @property
    def legal(self) -> NDArray[np.bool_]:
        """[M, G] the goals that may be chosen; a row may be empty."""
        return self.masks[:, :-1]

    def level(self, m: int) -> Any:
        """Return the m-th environment in words, as the world describes it."""
        return self.view.level(m, self.legal[m])

    def validate_goals(self, actions: ArrayLike) -> tuple[NDArray[np.integer], NDArray[np.bool_]]:
        """Return the goals [M] that actions [M] mean, -1 for no goal and for what is not legal, and which are legal.

        Actions are goal ids, or no goal (G or -1).
        """
        given, no_goal_action = np.asarray(actions), self.goal_set.no_goal_action
        if given.shape != self.envs.shape or given.dtype.kind not in "iu":
            raise InputError(
                f"the meta-controller's choice must be {len(self)} goal ids (whole numbers, one for each environment "
                f"whose turn it is), not an array of {given.dtype} and shape {given.shape}"
            )
        in_range = (given >= NO_GOAL) & (given <= no_goal_action)
        choices = np.where(in_range, given, no_goal_action).astype(np.int64)  # an unsigned number has no place for -1
        choices[choices == NO_GOAL] = no_goal_action
        is_legal = in_range & self.masks[np.arange(len(self)), choices]
        return np.where(is_legal & (choices < no_goal_action), choices, NO_GOAL), is_legal
