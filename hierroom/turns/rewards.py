"""Rewards of the controller: the protocol, the built-in ones, and loading custom ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import InputError, shown, user_code
from hierroom.support.plugins import load_plugin
from hierroom.turns.records import Step
from hierroom.worlds.env_config import NOVELTY_BONUS, RewardName

ENTRY_POINT_GROUP = "hierroom.rewards"


class Reward(Protocol):
    """Rewards the controller. Any class with a method `rewards` is a reward; other attributes are optional.

    A reward keeps no memory between steps, because the step has all it needs. So a step has the same reward in
    training, in evaluation and in any environment.

    Attributes:
        ends_with_option: whether the controller's return ends with its option, because no later reward depends on it;
            default False.
        memories: what the world must remember of each episode for the reward; default none.
        needs_states: whether the reward reads the states before and after a step, which are then copied at every step;
            default True.
    """

    def rewards(self, step: Step) -> NDArray[np.floating]:
        """Return the rewards for a step of N environments.

        Args:
            step: the goals pursued, what was achieved, what ended, and the states before and after; its ``rewards``
                are still zero.

        Returns:
            [N] finite numbers.
        """
        ...


class Extrinsic:
    """The environment's own reward, such as 1 at the exit."""

    needs_states = False

    def rewards(self, step: Step) -> NDArray[np.floating]:
        """Return the environment's own rewards [N]."""
        return step.extrinsic


class Bonus:
    """1 for each goal, such as a key, a door or the exit, when first achieved in an episode."""

    needs_states = False

    def rewards(self, step: Step) -> NDArray[np.floating]:
        """Return how many goals were achieved for the first time [N]."""
        return step.n_first.astype(np.float64)


class Intrinsic:
    """1 when the given goal is reached (see `ledger.Ledger`)."""

    ends_with_option = True
    needs_states = False

    def rewards(self, step: Step) -> NDArray[np.floating]:
        """Return 1 where the goal was reached, else 0 [N]."""
        return step.reached.astype(np.float64)


class Novelty:
    """The environment's own reward, and a bonus for each state (cell, keys found, doors open) new in the episode."""

    memories = ("visited",)
    needs_states = False

    def __init__(self, bonus: float) -> None:
        self._bonus = bonus

    def rewards(self, step: Step) -> NDArray[np.floating]:
        """Return the environment's own rewards plus the bonuses [N]."""
        return step.extrinsic + self._bonus * step.is_novel


RewardSpec = str | Reward | Callable[[Step], Any]
"""Forms in which `make_reward` accepts the controller's reward."""


REWARDS: Mapping[RewardName, Callable[[float], Reward]] = {
    "extrinsic": lambda _: Extrinsic(),
    "bonus": lambda _: Bonus(),
    "intrinsic": lambda _: Intrinsic(),
    "novelty": Novelty,
}
"""Makers of the built-in rewards by the names that users type; each takes the size of the novelty bonus."""


@dataclass(frozen=True)
class ControllerReward:
    """A reward with all attributes of `Reward`.

    Args:
        name: name for error messages.
        rewards: the method or function that computes the rewards.
    """

    name: str
    rewards: Callable[[Step], Any]
    ends_with_option: bool
    memories: tuple[str, ...]
    needs_states: bool

    def of(self, step: Step) -> NDArray[np.float64]:
        """Return the rewards [N] for a step."""
        shown = step if "visited" in self.memories else step.without_visits()
        with user_code(self.name):
            given = np.array(self.rewards(shown))
        if given.shape != (len(step.records),) or given.dtype.kind not in "fiub":
            raise InputError(
                f"{self.name} must return {len(step.records)} numbers, one for each environment, "
                f"not an array of {given.dtype} and shape {given.shape}"
            )
        rewards = given.astype(np.float64)
        if not np.isfinite(rewards).all():
            raise InputError(f"{self.name} must return finite numbers, not {given[~np.isfinite(rewards)][0]}")
        return rewards


def make_reward(spec: RewardSpec, novelty_bonus: float = NOVELTY_BONUS) -> ControllerReward:
    """Return the reward that a user specified.

    Args:
        spec: a name in `REWARDS` or of an entry point ``hierroom.rewards``; ``package.module:Class`` or
            ``package.module:function``, also in the current folder; a reward or its class; or a function like
            `Reward.rewards`.
        novelty_bonus: the size of the bonus of ``novelty``.
    """
    reward: Any = spec
    name = f"the reward {getattr(spec, '__name__', type(spec).__name__)}"
    if isinstance(spec, str):
        name = f"the reward {spec!r}"
        shipped = REWARDS.get(spec)  # pyright: ignore[reportArgumentType] - any text may be asked for
        reward = (
            shipped(novelty_bonus)
            if shipped
            else load_plugin(spec, "reward", REWARDS, ENTRY_POINT_GROUP, "Class or :function")
        )
    if isinstance(reward, type):
        with user_code(name, "cannot be made"):
            reward = reward()
    rewards = getattr(reward, "rewards", None)
    if not callable(rewards):
        if not callable(reward):
            raise InputError(f"a reward is a function of a step or has a method rewards(step); {name} is neither")
        rewards = reward
    with user_code(name):  # reading an attribute may run user code
        memories = getattr(reward, "memories", ())
        usual = {"ends_with_option": False, "needs_states": True}
        flags = {flag: getattr(reward, flag, value) for flag, value in usual.items()}
    if not isinstance(memories, (list, tuple)) or not all(isinstance(memory, str) for memory in memories):
        raise InputError(f"{name}: memories must be a list of names, not {shown(memories)}")
    for flag, value in flags.items():
        if not isinstance(value, (bool, np.bool_)):
            raise InputError(f"{name}: {flag} must be True or False, not {shown(value)}")
    return ControllerReward(name, rewards, memories=tuple(memories), **flags)
