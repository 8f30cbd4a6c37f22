"""The config of agents: their features, and the methods, each a pair of agents.

It loads neither the world nor torch, so that ``--help`` is fast.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import tyro

from hierroom.support.errors import InputError, shown
from hierroom.support.typed_value import Fraction, NotNegative, check_entries

DEFAULT_NETWORK = "recurrent"
"""The built-in network; all others are custom."""
ESCAPE_ROOM_FEATURES = (
    *("view", "view-ids", "goal", "goal-in-view", "goal-place", "object-places", "doorway-places", "frontier-places"),
    *("symbol", "direction", "keys", "previous-action", "goal-status", "goal-outcome"),
)
"""Names of the features that `agents.features.offered` returns for EscapeRooms."""
USUAL_FEATURES: Mapping[str, tuple[str, ...]] = {
    "features": (
        *("view", "goal", "goal-in-view", "goal-place", "direction", "keys", "previous-action"),
        *("doorway-places", "frontier-places"),
    ),
    "meta_features": ("goal-status", "goal-outcome"),
}
"""Features of the two agents in EscapeRooms where the config names none; a task has its own."""


@dataclass(frozen=True)
class Method:
    """A pair of agents: the usual ``meta_0``, as in `meta.META_CONTROLLERS`, and what ``controller_0`` is given."""

    meta: str
    reward: Any  # the usual one
    sees_goal: bool = False
    is_curious: bool = False  # whether it has `Curiosity`


MethodName = Literal["ppo", "ppo-bonus", "ppo-sketch", "hippo", "ppo-novelty", "ppo-rnd"]

METHODS: Mapping[str, Method] = {
    "ppo": Method("none", "extrinsic"),
    "ppo-bonus": Method("none", "bonus"),
    "ppo-sketch": Method("fixed-dfs", "extrinsic", sees_goal=True),
    "hippo": Method("fixed-dfs", "intrinsic", sees_goal=True),
    "ppo-novelty": Method("none", "novelty"),
    "ppo-rnd": Method("none", "extrinsic", is_curious=True),
}


def require_features(name: str, given: object, known: Collection[str] | None = None) -> None:
    """Refuse anything but a list of distinct feature names, all ``known`` if given; ``name`` is for the message."""
    if not isinstance(given, (list, tuple)):
        raise InputError(f"{name} are given as a list of names, not as {shown(given)}")
    unknown = [str(one) for one in given if not isinstance(one, str) or one not in (given if known is None else known)]
    if unknown or not given:
        allowed = "names" if known is None else ", ".join(known)
        raise InputError(f"{name} are {allowed}; not {', '.join(unknown) or 'none at all'}")
    if twice := [one for n, one in enumerate(given) if one in given[:n]]:
        raise InputError(f"{name} has {twice[0]} twice; name each once")


FEATURES = tyro.conf.arg(metavar="FEATURE [FEATURE ...]")
"""Placeholder for features on the command line."""


@dataclass(frozen=True)
class AgentsConfig:
    """The two agents.

    Args:
        method: a pair of agents; the other entries change parts of it.
        meta: who picks the goals: fixed-dfs, random, oracle, learned, none, package.module:Class or
            package.module:function. None: the method's own. In a task fixed-dfs can alternate for ever between two
            rules that take away what the other gives; random does not.
        network: the controller's network: recurrent (an encoder, which for a task is chosen from its observation
            space: convolutions for images, layers for vectors, embeddings for discrete numbers, and all of them for
            dicts; then an LSTM), or package.module:Class.
        features: inputs of the controller's network. In EscapeRooms any of view, view-ids, goal, goal-in-view,
            goal-place, object-places, doorway-places, frontier-places, symbol, direction, keys, previous-action and
            goal-status. Methods without goals leave out goal, goal-in-view, goal-place and symbol. None: those of
            `USUAL_FEATURES`, or the task's own.
        curiosity_weight: the weight of curiosity in the reward of ppo-rnd, after scaling its returns to deviation 1;
            the environment's own reward is added. On graph a (one seed, 1.5M steps, a discount of 0.98) 0.05 ended at
            100% success, 0.2 at 82%, and 0.5 (the weight of Burda et al. 2018) at 92%.
        meta_features: inputs of a learned meta-controller's network. In EscapeRooms, with goal-status and goal-outcome
            alone, all colours share one network (`agents.goal_network`); else it is the built-in recurrent one. None:
            these two, or the task's own.
        meta_start_success: a learned meta-controller chooses goals at random until this share of 100 episodes reaches
            the target, such as the exit (without a target: of 100 options their goals); then it learns.
    """

    method: MethodName = "hippo"
    meta: str | None = None
    network: str = DEFAULT_NETWORK
    features: Annotated[tuple[str, ...] | None, FEATURES] = None
    curiosity_weight: NotNegative = 0.05
    meta_features: Annotated[tuple[str, ...] | None, FEATURES] = None
    meta_start_success: Fraction = 0.03

    def __post_init__(self) -> None:
        for name in ("features", "meta_features"):
            if (given := getattr(self, name)) is not None:
                require_features(name, given)
        check_entries(self)
        for name in ("meta", "network"):
            if getattr(self, name) == "":
                raise InputError(f"{name} must be a name, not an empty text")

    def resolved_method(self, reward: Any) -> Method:
        """Return the method with the config's meta-controller and reward instead of its own; None keeps its own."""
        method = METHODS[self.method]
        return replace(method, meta=self.meta or method.meta, reward=method.reward if reward is None else reward)
