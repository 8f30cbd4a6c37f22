"""Rewards of the controller: the protocol, the built-in ones, and loading custom ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import InputError, shown, user_code
from hierroom.support.plugins import load_plugin
from hierroom.turns.records import Step
from hierroom.worlds.env_config import NOVELTY_BONUS, RewardName


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


RewardSpec = str | Reward | Callable[[Step], Any]
"""Forms in which `make_reward` accepts the controller's reward."""


@dataclass(frozen=True)
class ControllerReward:
    """A reward with all attributes of `Reward`: built in, or a user's.

    Args:
        weights: of the fields of a `Step` whose weighted sum the reward is: some of `records.REWARDED`. `record_turns`
            adds them up, in the compiled step.
        name: name for error messages.
        custom: the user's method or function, which computes the reward instead.
    """

    weights: Mapping[str, float]
    ends_with_option: bool = False
    memories: tuple[str, ...] = ()
    needs_states: bool = False
    name: str = ""
    custom: Callable[[Step], Any] | None = None

    def of(self, step: Step) -> NDArray[np.float64]:
        """Return the user's rewards [N] for a step."""
        assert self.custom is not None
        shown = step if "visited" in self.memories else step.without_visits()
        with user_code(self.name):
            given = np.array(self.custom(shown))
        if given.shape != (len(step.records),) or given.dtype.kind not in "fiub":
            raise InputError(
                f"{self.name} must return {len(step.records)} numbers, one for each environment, "
                f"not an array of {given.dtype} and shape {given.shape}"
            )
        rewards = given.astype(np.float64)
        if not np.isfinite(rewards).all():
            raise InputError(f"{self.name} must return finite numbers, not {given[~np.isfinite(rewards)][0]}")
        return rewards


REWARDS: Mapping[RewardName, ControllerReward] = {
    "extrinsic": ControllerReward({"extrinsic": 1}),
    "bonus": ControllerReward({"n_first": 1}),
    "intrinsic": ControllerReward({"reached": 1}, ends_with_option=True),
    "novelty": ControllerReward({"extrinsic": 1, "is_novel": NOVELTY_BONUS}, memories=("visited",)),
}
"""The built-in rewards by the names that users type."""


def make_reward(spec: RewardSpec, novelty_bonus: float = NOVELTY_BONUS) -> ControllerReward:
    """Return the reward that a user specified.

    Args:
        spec: a name in `REWARDS`; ``package.module:Class`` or ``package.module:function``, also in the current folder;
            a reward or its class; or a function like `Reward.rewards`.
        novelty_bonus: the size of the bonus of ``novelty``.
    """
    reward: Any = spec
    name = f"the reward {getattr(spec, '__name__', type(spec).__name__)}"
    if isinstance(spec, str):
        name = f"the reward {spec!r}"
        if (built_in := REWARDS.get(spec)) is not None:  # pyright: ignore[reportArgumentType] - any text may be asked for
            bonus = {"is_novel": novelty_bonus} if "is_novel" in built_in.weights else {}
            return replace(built_in, weights={**built_in.weights, **bonus}, name=name)
        reward = load_plugin(spec, "reward", REWARDS, "Class or :function")
    if isinstance(reward, type):
        with user_code(name, "cannot be made"):
            reward = reward()
    custom = getattr(reward, "rewards", None)
    if not callable(custom):
        if not callable(reward):
            raise InputError(f"a reward is a function of a step or has a method rewards(step); {name} is neither")
        custom = reward
    with user_code(name):  # reading an attribute may run user code
        memories = getattr(reward, "memories", ())
        usual = {"ends_with_option": False, "needs_states": True}
        flags = {flag: getattr(reward, flag, value) for flag, value in usual.items()}
    if not isinstance(memories, (list, tuple)) or not all(isinstance(memory, str) for memory in memories):
        raise InputError(f"{name}: memories must be a list of names, not {shown(memories)}")
    for flag, value in flags.items():
        if not isinstance(value, (bool, np.bool_)):
            raise InputError(f"{name}: {flag} must be True or False, not {shown(value)}")
    return ControllerReward({}, memories=tuple(memories), name=name, custom=custom, **flags)
