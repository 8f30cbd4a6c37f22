"""What a checkpoint can hold: tensors and plain types, so that nothing in it is ever executed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

from hierroom.support.errors import InputError

_DEEPEST = 50
"""Levels of lists and dicts in each other: deeper ones, and those that hold themselves, could not be read again."""


def plain_state(value: Any, name: str, depth: int = 0) -> Any:
    """A state as tensors and plain types; numbers, texts and arrays of NumPy become those of Python and tensors.

    Args:
        value: the state.
        name: what it is, for the error message, such as ``agents.meta_0``.
        depth: how many lists and dicts it stands in.
    """
    if depth > _DEEPEST:
        raise InputError(f"a checkpoint cannot hold {name[:100]}...: it lies in more than {_DEEPEST} lists and dicts")
    if value is None or type(value) in (bool, int, float, str, bytes):
        return value
    if isinstance(value, torch.Tensor) and value.layout is torch.strided and not value.is_quantized:
        return value.detach()
    if isinstance(value, np.generic) and value.dtype.kind in "biufUS":
        return float(value) if value.dtype.kind == "f" else value.item()  # a long double stays one as an item
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf" and value.dtype.itemsize <= 8:
        return torch.from_numpy(value.astype(value.dtype.newbyteorder("=")))
    if isinstance(value, Mapping):
        return {_key(key, name): plain_state(entry, f"{name}.{key}", depth + 1) for key, entry in value.items()}
    if isinstance(value, (list, tuple)) and type(value) in (list, tuple):
        plain = [plain_state(entry, f"{name}[{n}]", depth + 1) for n, entry in enumerate(value)]
        return plain if type(value) is list else tuple(plain)
    raise InputError(
        f"a checkpoint cannot hold {name}, which is {type(value).__name__}; it holds tensors, arrays of numbers, "
        "numbers, texts, lists and dicts"
    )


def _key(key: Any, name: str) -> Any:
    """A key of a dict as a plain type."""
    if type(key) is tuple:
        return tuple(_key(part, name) for part in key)
    plain = key.item() if isinstance(key, np.generic) and key.dtype.kind in "biufUS" else key
    if type(plain) not in (int, float, str, bool):
        raise InputError(f"a checkpoint cannot hold {name}, which is a mapping with other keys than texts and numbers")
    return plain
