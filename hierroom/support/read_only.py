"""Arrays that only their owner may write."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np


def read_only(array: np.ndarray) -> np.ndarray:
    """Return a read-only view of an array, which shows its owner's writes."""
    view = array.view()
    view.setflags(write=False)
    return view


class Shown:
    """An attribute of a class: the array that an object keeps under the same name with ``_`` before it, read-only."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._kept_as = f"_{name}"

    def __get__(self, instance: Any, owner: type | None = None) -> np.ndarray:
        return read_only(getattr(instance, self._kept_as))


def freeze(value: Any) -> Any:
    """Make an array read-only, or the arrays in an object or a mapping; return it."""
    held = value.values() if isinstance(value, Mapping) else getattr(value, "__dict__", {}).values()
    for array in (value, *held):
        if isinstance(array, np.ndarray):
            array.setflags(write=False)
    return value
