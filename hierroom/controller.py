"""The controller's observations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.goals.goal_set import GoalSet


@dataclass(frozen=True)
class Observation:
    """M environments at one moment, from which observations and the features of a network are computed.

    Attributes of the view can be read directly: ``observation.levels`` is ``observation.view.levels``.

    Args:
        envs: [M] int, the environments' places in the batch.
        view: what the world shows, such as a `worlds.base_view.BaseView`.
        goal_set: the goals of the world.
        goals: [M] int, the goals pursued, or -1. For the meta-controller: the goals of its last ended options.
        previous_actions: [M] int, the controller's last action. Before the first action, and after one that does not
            exist, it is the number of actions. If they are arrays, it is 0, or then 1.
        outcomes: [M] int, how the last option ended: ``NO_OUTCOME``, ``REACHED``, ``TIMED_OUT`` or ``OTHER``.
        masks: [M, A] bool, the legal actions of the agent; [M, 0] if its actions are arrays.

    Examples:
        >>> turns = hierroom.load("a").turns(num_envs=2, seed=1)
        >>> observation = turns.observe("controller_0", np.arange(2))
        >>> observation.levels["steps"].tolist(), observation.as_dict()["goal"].shape
        ([0, 0], (2, 9))
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
        if name.startswith("__") or name == "view":
            raise AttributeError(name)
        try:
            return getattr(self.view, name)
        except AttributeError:
            raise AttributeError(
                f"{name!r} is neither of every {type(self).__name__.lower()} nor of this world's"
            ) from None

    def as_dict(self) -> dict[str, NDArray]:
        """Return the observations as the PettingZoo and Gymnasium APIs give them, in new arrays.

        Returns:
            The world's entries (for an EscapeRoom see `level_view.LevelView.as_dict`), ``goal`` [M, K] float32 (the
            goal's vector) and, unless actions are arrays, ``action_mask`` [M, A] int8.
        """
        shown = {**self.view.as_dict(), "goal": self.goal_set.vectors[self.goals]}
        return shown | ({"action_mask": self.masks.astype(np.int8)} if self.masks.shape[1] else {})


def observation_spaces(world: dict[str, spaces.Space], goals: GoalSet, n_actions: int) -> dict[str, spaces.Space]:
    """Return the spaces of `Observation.as_dict`; ``world`` has the spaces of the world's own entries."""
    low, high = float(goals.vectors.min()), float(goals.vectors.max())
    goal = spaces.Box(min(0, low), max(1, high), goals.vectors.shape[1:], np.float32)
    mask: dict[str, spaces.Space] = {"action_mask": spaces.Box(0, 1, (n_actions,), np.int8)} if n_actions else {}
    return {**world, "goal": goal, **mask}
