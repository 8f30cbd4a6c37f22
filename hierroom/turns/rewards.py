"""Rewards of the controller: the protocol, those that ship, and how custom ones are found."""

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
    """Rewards the controller. Any class with `rewards` will do; its other attributes are optional.

    A reward remembers nothing from step to step: what it needs is in the step, so that the same step is worth the same
    in training, in evaluation and in any environment.

    Attributes:
        ends_with_option: whether the controller's return ends where its option ends, as no later reward depends on it;
            False unless given.
        memories: what the world must remember of each episode for it; none unless given.
        needs_states: whether the step holds the states before and after it, which are copied at every step for this;
            True unless given.
    """

    def rewards(self, step: Step) -> NDArray[np.floating]:
        """Return the rewards for a step of N environments.

        Args:
            step: what it did: the goals pursued, what was achieved, what ended, and the states before and after; its
                own ``rewards`` are zero yet.

        Returns:
            [N] finite numbers.
        """
        ...


class Extrinsic:
    """1 at the exit."""

    needs_states = False

    def rewards(self, step: Step) -> NDArray[np.floating]:
        """Return the environment's own rewards [N]."""
        return step.extrinsic


class Bonus:
    """1 for each key, door and the exit, once an episode."""

    needs_states = False

    def rewards(self, step: Step) -> NDArray[np.floating]:
        """Return how many goals were achieved for the first time [N]."""
        return step.n_first.astype(np.float64)


class Intrinsic:
    """1 where the given goal is reached (`ledger.Ledger`)."""

    ends_with_option = True
    needs_states = False

    def rewards(self, step: Step) -> NDArray[np.floating]:
        """Return 1 where the goal was reached, else 0 [N]."""
        return step.reached.astype(np.float64)


class Novelty:
    """1 at the exit, and a bonus for each state (cell, keys found, doors open) new in the episode."""

    memories = ("visited",)
    needs_states = False

    def __init__(self, bonus: float) -> None:
        self._bonus = bonus

    def rewards(self, step: Step) -> NDArray[np.floating]:
        """Return the environment's own rewards plus the bonuses [N]."""
        return step.extrinsic + self._bonus * step.is_novel


RewardSpec = str | Reward | Callable[[Step], Any]
"""The controller's reward, as `make_reward` takes it."""


REWARDS: Mapping[RewardName, Callable[[float], Reward]] = {
    "extrinsic": lambda _: Extrinsic(),
    "bonus": lambda _: Bonus(),
    "intrinsic": lambda _: Intrinsic(),
    "novelty": Novelty,
}
"""The rewards that ship, by the name users type, each made with the size of the novelty bonus."""


@dataclass(frozen=True)
class ControllerReward:
    """A reward and what environments must know of it: its attributes are those of `Reward`.

    Args:
        name: for error messages.
        rewards: the method or function that computes them.
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
    """Return the reward that a user means.

    Args:
        spec: a name in `REWARDS` or of an entry point ``hierroom.rewards``; ``package.module:Class`` or
            ``package.module:function``, in the current folder too; a reward or its class; or a function like
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
    with user_code(name):  # to look at an attribute may run code
        memories = getattr(reward, "memories", ())
        usual = {"ends_with_option": False, "needs_states": True}
        flags = {flag: getattr(reward, flag, value) for flag, value in usual.items()}
    if not isinstance(memories, (list, tuple)) or not all(isinstance(memory, str) for memory in memories):
        raise InputError(f"{name}: memories must be a list of names, not {shown(memories)}")
    for flag, value in flags.items():
        if not isinstance(value, (bool, np.bool_)):
            raise InputError(f"{name}: {flag} must be True or False, not {shown(value)}")
    return ControllerReward(name, rewards, memories=tuple(memories), **flags)
