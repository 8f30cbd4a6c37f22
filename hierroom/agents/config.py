"""Agents as data: the features they can have, and the methods, each a pair of agents.

It loads neither the world nor torch, so that a command can explain itself at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from hierroom.env_config import RewardName
from hierroom.errors import InputError

FeatureName = Literal[
    "view",
    "view-ids",
    "goal",
    "goal-in-view",
    "goal-place",
    "doorway-places",
    "frontier-places",
    "symbol",
    "direction",
    "keys",
    "previous-action",
    "goal-status",
    "goal-outcome",
]
"""What `agents.features.FEATURES` has."""


@dataclass(frozen=True)
class Controller:
    """The ``controller_0`` of a method.

    Args:
        reward: its reward unless another is named, as in `controller.REWARDS`.
        sees_goal: whether its features hold the goal.
        network: its network unless another is named, as in `agents.networks.NETWORKS`.
        is_curious: whether it is rewarded, besides, for what random network distillation finds new.
    """

    reward: RewardName
    sees_goal: bool = False
    network: str = "recurrent"
    is_curious: bool = False


@dataclass(frozen=True)
class Method:
    """A pair of agents.

    Args:
        meta: its ``meta_0`` unless another is named, as in `meta.META_CONTROLLERS`.
        controller: its ``controller_0``.
    """

    meta: str
    controller: Controller


MethodName = Literal["ppo", "ppo-bonus", "ppo-sketch", "hippo", "ppo-novelty", "ppo-rnd", "ppo-modular"]

METHODS: Mapping[str, Method] = {
    "ppo": Method("none", Controller("extrinsic")),
    "ppo-bonus": Method("none", Controller("bonus")),
    "ppo-sketch": Method("fixed-dfs", Controller("extrinsic", sees_goal=True)),
    "hippo": Method("fixed-dfs", Controller("intrinsic", sees_goal=True)),
    "ppo-novelty": Method("none", Controller("novelty")),
    "ppo-rnd": Method("none", Controller("extrinsic", is_curious=True)),
    "ppo-modular": Method("fixed-dfs", Controller("extrinsic", network="modular")),
}


def find_method(name: str) -> Method:
    """The method of that name.

    Raises:
        InputError: if there is none.
    """
    if name not in METHODS:
        raise InputError(f"the methods are {', '.join(METHODS)}; there is no {name!r}")
    return METHODS[name]
