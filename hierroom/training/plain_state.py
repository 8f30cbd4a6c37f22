"""What a checkpoint can hold: tensors and plain types, so that nothing in it is ever executed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

from hierroom.errors import InputError


def plain_state(value: Any, name: str) -> Any:
    """A state as tensors and plain types; numbers and arrays of NumPy become numbers of Python and tensors.

    Args:
        value: the state.
        name: what it is, for the error message, such as ``agents.meta_0``.

    Raises:
        InputError: if an entry is of another type.
    """
    if value is None or type(value) in (bool, int, float, str, bytes):
        return value
    if isinstance(value, torch.Tensor):
        return value.detach()
    if isinstance(value, (np.generic, np.ndarray)) and value.dtype.kind in "biuf":
        return value.item() if isinstance(value, np.generic) else torch.from_numpy(value.copy())
    if isinstance(value, Mapping) and all(type(key) in (int, float, str, bool, tuple) for key in value):
        return {key: plain_state(entry, f"{name}.{key}") for key, entry in value.items()}
    if type(value) is list:
        return [plain_state(entry, f"{name}[{n}]") for n, entry in enumerate(value)]
    if type(value) is tuple:
        return tuple(plain_state(entry, f"{name}[{n}]") for n, entry in enumerate(value))
    kind = "a mapping with other keys than texts and numbers" if isinstance(value, Mapping) else type(value).__name__
    raise InputError(
        f"a checkpoint cannot hold {name}, which is {kind}; it holds tensors, arrays of numbers, numbers, texts, lists "
        "and dicts"
    )
