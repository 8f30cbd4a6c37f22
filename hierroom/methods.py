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
        network: the controller's network unless another is named, as in `network.NETWORKS`.
        is_curious: whether the controller is paid for what `RandomDistillation` finds new, besides.
    """

    meta: str
    sees_goal: bool
    pay: str
    network: str = "recurrent"
    is_curious: bool = False


METHODS: Mapping[str, Method] = {
    "ppo": Method("none", False, "extrinsic"),
    "ppo-bonus": Method("none", False, "bonus"),
    "ppo-sketch": Method("fixed-dfs", True, "extrinsic"),
    "hippo": Method("fixed-dfs", True, "intrinsic"),
    "ppo-novelty": Method("none", False, "novelty"),
    "ppo-rnd": Method("none", False, "extrinsic", is_curious=True),
    "ppo-modular": Method("fixed-dfs", False, "extrinsic", "modular"),
}


def find_method(name: str) -> Method:
    """The method of that name.

    Raises:
        InputError: if there is none.
    """
    if name not in METHODS:
        raise InputError(f"the methods are {', '.join(METHODS)}; there is no {name!r}")
    return METHODS[name]
