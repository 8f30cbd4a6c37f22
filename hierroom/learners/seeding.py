"""Weights that a seed fixes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import torch


@contextmanager
def seeded_weights(seed: np.random.SeedSequence) -> Iterator[None]:
    """Make weights that depend on a seed alone: not on torch's global generator, and not on its number of threads.

    Orthogonal matrices come from a decomposition that rounds differently on two threads than on one.

    Args:
        seed: of the weights made within.
    """
    n_threads = torch.get_num_threads()
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(int(seed.generate_state(1)[0]))
        torch.set_num_threads(1)
        try:
            yield
        finally:
            torch.set_num_threads(n_threads)
