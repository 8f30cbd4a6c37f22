"""The methods one can train, as data: who picks goals, whether the controller sees them, how it is paid."""

from collections.abc import Mapping
from dataclasses import dataclass

from hierroom.errors import InputError


@dataclass(frozen=True)
class Method:
    """One row of the table of methods.

    Args:
        meta: the meta-controller it uses unless another is named, as in `meta.META_CONTROLLERS`.
        sees_goal: whether the controller's inputs hold the goal.
        pay: how the controller is paid, as in `controller.PAYS`.
        about: one line for people.
        network: the controller's network unless another is named, as in `network.NETWORKS`.
        is_curious: whether the controller is paid for what `RandomDistillation` finds new, besides.
    """

    meta: str
    sees_goal: bool
    pay: str
    about: str
    network: str = "recurrent"
    is_curious: bool = False


METHODS: Mapping[str, Method] = {
    "ppo": Method("none", False, "extrinsic", "flat PPO, paid at the exit"),
    "ppo-bonus": Method("none", False, "bonus", "flat PPO, paid for each key and door too"),
    "ppo-sketch": Method("fixed-dfs", True, "extrinsic", "PPO that sees the goals, paid at the exit"),
    "hippo": Method("fixed-dfs", True, "intrinsic", "hierarchical PPO, the controller paid for reaching its goals"),
    "ppo-novelty": Method("none", False, "novelty", "flat PPO, paid at the exit and for states new in the episode"),
    "ppo-rnd": Method(
        "none", False, "extrinsic", "flat PPO, paid at the exit and for what is new to it", is_curious=True
    ),
    "ppo-modular": Method("fixed-dfs", False, "extrinsic", "a sub-policy for each goal, paid at the exit", "modular"),
}


def find_method(name: str) -> Method:
    """The method of that name.

    Raises:
        InputError: if there is none.
    """
    if name not in METHODS:
        raise InputError(f"the methods are {', '.join(METHODS)}; there is no {name!r}")
    return METHODS[name]
