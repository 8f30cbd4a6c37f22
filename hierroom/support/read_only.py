"""Arrays that others may read and nobody but their owner may write."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np


def read_only(array: np.ndarray) -> np.ndarray:
    """Return a view of an array that cannot be written through, and shows what its owner writes."""
    view = array.view()
    view.setflags(write=False)
    return view


def freeze(value: Any) -> Any:
    """Let nobody write to an array, or to the arrays in an object or a mapping; return it."""
    held = value.values() if isinstance(value, Mapping) else getattr(value, "__dict__", {}).values()
    for array in (value, *held):
        if isinstance(array, np.ndarray):
            array.setflags(write=False)
    return value
