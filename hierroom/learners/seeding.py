"""Initial weights that depend only on a seed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import torch


@contextmanager
def seeded_weights(seed: np.random.SeedSequence) -> Iterator[None]:
    """A context in which new weights depend only on ``seed``, not on torch's global generator or number of threads.

    Orthogonal initialisation uses a matrix decomposition that rounds differently with two threads than with one.

    Args:
        seed: seed of the weights that are created in the context.
    """
    n_threads = torch.get_num_threads()
    with torch.random.fork_rng(devices=[]):
        # Not torch.manual_seed, which seeds the generators of accelerators, too, and these are not restored.
        torch.default_generator.manual_seed(int(seed.generate_state(1)[0]))
        torch.set_num_threads(1)
        try:
            yield
        finally:
            torch.set_num_threads(n_threads)
