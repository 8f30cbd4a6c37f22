"""Checks for numbers that are not finite or too large to learn from."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from hierroom.learners.policy import Stepper
from hierroom.learners.rollout import Batch
from hierroom.learners.torch_backend import STATISTICS
from hierroom.support.errors import DivergenceError, InputError

LIMIT = 1e15
"""Numbers of at least this size count as diverged, because their squares in the losses soon overflow float32."""
N_TRIED = 16
"""Number of sequences on which to try new weights."""
Named = tuple[str, NDArray[np.floating] | Tensor]
"""A name for messages, and an array or tensor of any shape on any device."""


def check_health(numbers: Iterable[Named], advice: str) -> None:
    """Raise a `DivergenceError` with advice if any number is not finite or not below `LIMIT`."""
    for name, values in numbers:
        # In NumPy: between two updates the code of torch leaves the caches, and loading it takes ten times as long.
        flat = (_as_array(values) if isinstance(values, Tensor) else values).reshape(-1)
        with np.errstate(over="ignore", invalid="ignore"):
            # The sum of squares is twice as fast as checking each number.
            if flat.dtype.kind != "f" or np.dot(flat, flat) < LIMIT**2:
                continue
            is_wrong = ~(np.abs(flat) < LIMIT)
        if is_wrong.any():
            found = f"{flat[is_wrong][0]:g} in {is_wrong.sum():,} of {len(flat):,} numbers"
            raise DivergenceError(f"{name} ({found}); {advice}")


def _as_array(tensor: Tensor) -> NDArray:
    tensor = tensor.detach().cpu()
    return (tensor.float() if tensor.dtype == torch.bfloat16 else tensor).numpy()  # NumPy has no bfloat16


def check_start(network: nn.Module) -> None:
    """Check the first weights of a network."""
    try:
        check_health(network.named_parameters(), "a network must start with finite weights")
    except DivergenceError as error:
        raise InputError(f"{type(network).__name__}: {error}") from error


def check_batch(batch: Batch) -> None:
    """Check the rewards and the network's outputs before learning from them."""
    check_health([("rewards", batch.rewards)], "make the rewards smaller")
    acted = ("recurrent states", batch.initial_states), ("values", batch.values), ("values", batch.next_values)
    advice = "the network computed them from finite weights: look there"
    check_health([*acted, ("log_probs", batch.log_probs)], advice)


def check_update(
    means: NDArray[np.floating],  # [6] the mean of each of `STATISTICS` over the minibatches
    weights: Iterable[Named],  # the new weights
    stepper: Stepper,
    batch: Batch,
    learning_rate: float,
) -> None:
    """Check the statistics of an update, its weights and their outputs, before they are used or saved."""
    advice = f"a learning_rate below {learning_rate:g}, or smaller weights of the losses, may help"
    if not np.isfinite(means).all():
        wrong = [f"{name} {mean:g}" for name, mean in zip(STATISTICS, means, strict=True) if not np.isfinite(mean)]
        raise DivergenceError(f"{', '.join(wrong)}; {advice}")
    check_health(((f"weights {name}", values) for name, values in weights), advice)
    # Finite weights can have infinite outputs, so compute one turn of a few sequences.
    outputs = stepper.evaluate(batch.features[-1, :N_TRIED], batch.initial_states[:N_TRIED])
    check_health(zip(("logits", "values", "recurrent states"), outputs, strict=True), advice)
