"""Whether the numbers of a learner are such that it can go on learning from them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from hierroom.errors import DivergenceError

LIMIT = 1e15
"""The size from which on a number counts as diverged: its square, which the losses take, soon leaves float32."""


def check_health(numbers: Iterable[tuple[str, NDArray[np.floating] | Tensor]], advice: str) -> None:
    """Check that arrays and tensors hold finite numbers below `LIMIT` in size; those of whole numbers always do.

    Args:
        numbers: what each is called, and the array or tensor of any shape, on any device.
        advice: what to do where one does not, for the error message.

    Raises:
        DivergenceError: naming the first that holds another number.
    """
    for name, values in numbers:
        tensor = values.detach() if isinstance(values, Tensor) else torch.from_numpy(values)
        if not tensor.is_floating_point():
            continue
        flat = tensor.reshape(-1)
        if float(torch.dot(flat, flat)) < LIMIT**2:  # so each is smaller; twice as fast as to look at each
            continue
        is_wrong = ~(flat.abs() < LIMIT)
        if is_wrong.any():
            raise DivergenceError(
                f"{name} ({float(flat[is_wrong][0]):g} in {int(is_wrong.sum()):,} of {len(flat):,} numbers); {advice}"
            )
