"""Whether the numbers of a learner are such that it can go on learning from them."""

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
"""The size from which on a number counts as diverged: its square, which the losses take, soon leaves float32."""

N_TRIED = 16
"""Sequences that new weights are tried on."""


Named = tuple[str, NDArray[np.floating] | Tensor]
"""What numbers are called, and the array or tensor of any shape that holds them."""


def weights_of(network: nn.Module) -> list[Named]:
    """The weights of a network, as they are now and whenever they are looked at again.

    Those in the processor's memory come as arrays that share it: NumPy is there at once between two updates, where
    PyTorch takes ten times as long to find its code again.
    """
    return [(name, tensor.numpy() if _is_array(tensor) else tensor) for name, tensor in network.state_dict().items()]


def _is_array(tensor: Tensor) -> bool:
    return tensor.device.type == "cpu" and tensor.dtype in (torch.float32, torch.float64) and tensor.is_contiguous()


def check_health(
    numbers: Iterable[Named],  # what each is called, and the array or tensor of any shape, on any device
    advice: str,  # what to do where one does not, for the error message
) -> None:
    """Check that arrays and tensors hold finite numbers below `LIMIT` in size; those of whole numbers always do.

    Raises:
        DivergenceError: naming the first that holds another number.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        suspects = [(name, values) for name, values in numbers if not _is_small(values)]
    for name, values in suspects:
        tensor = values.detach() if isinstance(values, Tensor) else torch.from_numpy(values)
        if not tensor.is_floating_point():
            continue
        flat = tensor.reshape(-1)
        is_wrong = ~(flat.abs() < LIMIT)
        if is_wrong.any():
            raise DivergenceError(
                f"{name} ({float(flat[is_wrong][0]):g} in {int(is_wrong.sum()):,} of {len(flat):,} numbers); {advice}"
            )


def _is_small(values: NDArray[np.floating] | Tensor) -> bool:
    """Whether the sum of squares says already that each number is small: twice as fast as to look at each."""
    if isinstance(values, Tensor):
        flat = values.detach().reshape(-1)
        return flat.is_floating_point() and float(torch.dot(flat, flat)) < LIMIT**2
    flat = values.reshape(-1)
    return flat.dtype.kind == "f" and bool(np.dot(flat, flat) < LIMIT**2)


def check_start(network: nn.Module) -> None:
    """Check the weights with which a network begins."""
    try:
        check_health(network.state_dict().items(), "a network must start with finite weights")
    except DivergenceError as error:
        raise InputError(f"{type(network).__name__}: {error}") from error


def check_batch(batch: Batch) -> None:
    """Check what was collected, before anything is learned from it.

    Raises:
        DivergenceError: if a reward, or what the network gave, is not healthy.
    """
    check_health([("rewards", batch.rewards)], "make the rewards smaller")
    acted = ("recurrent states", batch.initial_states), ("values", batch.values), ("values", batch.next_values)
    advice = "the network computed them from finite weights: look there"
    check_health([*acted, ("log_probs", batch.log_probs)], advice)


def check_update(
    means: NDArray[np.floating],  # [6] the mean of each of `STATISTICS` over the minibatches
    weights: Iterable[Named],  # the new ones, as `weights_of` the network
    stepper: Stepper,  # the backend that computes with them
    batch: Batch,  # what was learned from
    learning_rate: float,  # Adam's step size
) -> None:
    """Check what an update did, before it is used or saved.

    Raises:
        DivergenceError: if a statistic or a weight is not healthy, or something that the weights give.
    """
    advice = f"a learning_rate below {learning_rate:g}, or smaller weights of the losses, may help"
    if not np.isfinite(means).all():
        wrong = [f"{name} {mean:g}" for name, mean in zip(STATISTICS, means, strict=True) if not np.isfinite(mean)]
        raise DivergenceError(f"{', '.join(wrong)}; {advice}")
    check_health(((f"weights {name}", values) for name, values in weights), advice)
    # Weights can be finite and what they give not; a turn of a few sequences tells.
    outputs = stepper.evaluate(batch.features[-1, :N_TRIED], batch.initial_states[:N_TRIED])
    check_health(zip(("logits", "values", "recurrent states"), outputs, strict=True), advice)
