"""What a user's own meta-controller must have."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hierroom.support.errors import InputError, shown


def checked_meta(meta: Any, name: str) -> Any:
    """Refuse what cannot be a meta-controller (`hierroom.meta.MetaController`), however far it is from one.

    Args:
        meta: anything at all.
        name: of it, for messages.

    Returns:
        ``meta``.
    """
    if isinstance(meta, type):
        raise InputError(f"a meta-controller is an object, not a class: make one of {meta.__name__}")
    if isinstance(meta, (np.ndarray, np.generic)) or not callable(getattr(meta, "choose", None)):  # NumPy's is another
        raise InputError(f"a meta-controller has a method choose(observations, legal, situation); {name} has none")
    if hasattr(meta, "for_training") and not hasattr(meta, "for_play"):
        raise InputError(
            f"a meta-controller that for_training makes for a number of environments has a method "
            f"for_play(num_envs, *, seed) too, to play in others; {name} has none"
        )
    for method in ("reset", "observe", "learn", "state_dict", "load_state_dict", "for_play"):
        if not callable(getattr(meta, method, print)):
            raise InputError(f"{method} of a meta-controller is a method; that of {name} is {getattr(meta, method)!r}")
    statistics = getattr(meta, "statistics", {})
    if not isinstance(statistics, Mapping):
        raise InputError(
            f"statistics of a meta-controller are numbers by name; those of {name} are {shown(statistics)}"
        )
    for entry, value in statistics.items():
        if not (isinstance(entry, str) and _is_number(value)):
            raise InputError(
                f"statistics of a meta-controller are numbers by name; {shown(entry)} of {name} is {shown(value)}"
            )
    if hasattr(meta, "learn") and not (hasattr(meta, "state_dict") and hasattr(meta, "load_state_dict")):
        raise InputError(
            f"a meta-controller that learns has the methods state_dict and load_state_dict too, or what it learned "
            f"would be lost; {name} has not both"
        )
    return meta


def _is_number(value: Any) -> bool:
    try:
        float(value)
    except (TypeError, ValueError):
        return False
    return not isinstance(value, str)
