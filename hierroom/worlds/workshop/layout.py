"""The memory layout of workshops: the record of an environment, and the things in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierroom.support.schema import record_type
from hierroom.worlds.seeds import SOURCE_FIELDS

PLACES, SHELF, BENCH = range(3)
"""Rows of an environment's things [3, T]: the thing at each place of the shelf (P of them, then zeros), and the counts
of each thing on the shelf and on the bench."""


SHOP = record_type(
    *SOURCE_FIELDS,
    ("max_steps", "i4"),
    ("split", "i4"),  # number in `SPLITS` of the set of shelf orders to draw from
    ("steps", "i4"),
    ("achieved", "i8"),  # bit g: goal g was achieved in this episode
    ("n_first", "i4"),  # number of these bits
    ("has_ended", "?"),
)


@dataclass(frozen=True)
class WorkshopState:
    """The exact state of N workshops: records [N] of `SHOP`, things [N, 3, T] and past contents of the bench [N, V].

    ``visited`` is a table of keys (see `kernels.visit`); V is 0 if nothing needs it.
    """

    shops: np.ndarray
    things: NDArray[np.uint8]
    visited: NDArray[np.uint64]

    def __len__(self) -> int:
        return len(self.shops)

    def __getitem__(self, indices) -> WorkshopState:
        """Copy the state of some environments; an integer index gives a batch of one."""
        chosen = np.atleast_1d(np.arange(len(self))[indices])
        return WorkshopState(self.shops[chosen], self.things[chosen], self.visited[chosen])
