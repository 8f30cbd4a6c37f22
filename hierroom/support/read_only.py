"""Arrays that only their owner may write."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np


def read_only(array: np.ndarray) -> np.ndarray:
    """Return a read-only view of an array; changes by the array's owner are visible in it."""
    view = array.view()
    view.setflags(write=False)
    return view


class Shown:
    """A read-only attribute ``name``: a view of the array that the object keeps as ``_name``."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._kept_as = f"_{name}"

    def __get__(self, instance: Any, owner: type | None = None) -> np.ndarray:
        return read_only(getattr(instance, self._kept_as))


def freeze(value: Any) -> Any:
    """Make an array, or the arrays in an object or a mapping, read-only; return the same value."""
    held = value.values() if isinstance(value, Mapping) else getattr(value, "__dict__", {}).values()
    for array in (value, *held):
        if isinstance(array, np.ndarray):
            array.setflags(write=False)
    return value
