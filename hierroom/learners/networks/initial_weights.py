"""Initial weights that depend only on a seed, not on what other threads draw or set."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Lock
from typing import Any

import numpy as np
import torch
from torch.overrides import TorchFunctionMode

_IN_PLACE = ("bernoulli", "cauchy", "exponential", "geometric", "log_normal", "normal", "random", "uniform")
_NEW = ("bernoulli", "multinomial", "normal", "poisson", "rand", "rand_like", "randint", "randint_like", "randn")
_OF_INIT = ("kaiming_normal_", "kaiming_uniform_", "normal_", "orthogonal_", "sparse_", "trunc_normal_", "uniform_")
_DRAWS = {
    *(getattr(torch.Tensor, f"{name}_") for name in _IN_PLACE),
    *(getattr(torch, name) for name in (*_NEW, "randn_like", "randperm")),
    *(getattr(torch.nn.init, name) for name in (*_OF_INIT, "xavier_normal_", "xavier_uniform_")),
}
"""The functions of torch that draw random numbers and take a generator."""
_threads_change = Lock()


@contextmanager
def seeded_weights(seed: np.random.SeedSequence) -> Iterator[None]:
    """Make new weights depend only on ``seed``, also in networks that take no seed.

    In this thread, torch draws from a private generator the numbers that its global one would give after seeding. The
    global one is unchanged, so other threads may use it. Functions that take no generator, such as dropout, still draw
    from it. Weights do not depend on the user's default device, gradient mode or precision.
    """
    generator = torch.Generator().manual_seed(int(seed.generate_state(1)[0]))
    # Orthogonal weights round differently with two threads.
    with _DrawsFrom(generator), torch.device("cpu"), plain_torch(), torch_threads(1):
        yield


class _DrawsFrom(TorchFunctionMode):
    """A context in which this thread draws from a generator instead of torch's global one."""

    def __init__(self, generator: torch.Generator) -> None:
        super().__init__()
        self._generator = generator

    def __torch_function__(
        self, func: Callable[..., Any], types: Sequence[type], args: Sequence = (), kwargs: Mapping | None = None
    ) -> Any:
        given = dict(kwargs or {})
        if func in _DRAWS and given.get("generator") is None:
            named = given.get("device")  # a text, a number or a torch.device
            devices = (named, *(getattr(one, "device", None) for one in (*args, *given.values())))
            if all(one is None or torch.device(one).type == "cpu" for one in devices):
                given["generator"] = self._generator
        return func(*args, **given)


@contextmanager
def plain_torch() -> Iterator[None]:
    """Use torch's defaults in this thread: with gradients and in full precision."""
    with torch.inference_mode(False), torch.enable_grad(), torch.autocast("cpu", enabled=False):
        yield


@contextmanager
def torch_threads(number: int) -> Iterator[None]:
    """Let torch compute in a number of threads."""
    before = torch.get_num_threads()
    _set_num_threads(number)
    try:
        yield
    finally:
        _set_num_threads(before)


def _set_num_threads(number: int) -> None:
    """Set torch's number of threads for this thread alone, and undo torch's change for threads started later."""
    if torch.get_num_threads() == number:
        return
    with _threads_change, ThreadPoolExecutor(1) as ours, ThreadPoolExecutor(1) as later:
        of_threads_to_come = ours.submit(torch.get_num_threads).result()
        torch.set_num_threads(number)
        later.submit(torch.set_num_threads, of_threads_to_come).result()
