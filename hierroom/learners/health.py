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
        if tensor.numel() == 0 or not tensor.is_floating_point():
            continue
        low, high = torch.stack(torch.aminmax(tensor)).tolist()  # NaN if any number is
        if not -LIMIT < low <= high < LIMIT:
            n_wrong = int((~(tensor.abs() < LIMIT)).sum())
            worst = high if low > -LIMIT else low
            raise DivergenceError(f"{name} ({worst:g} in {n_wrong:,} of {tensor.numel():,} numbers); {advice}")
