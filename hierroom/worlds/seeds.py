"""Select environments of a batch, and set the seeds of their episodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeGuard

import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import InputError
from hierroom.support.schema import Whole
from hierroom.worlds.world import Seeds

SOURCE_FIELDS = (
    ("seed", "u8"),
    ("index", "i8"),  # index of the environment; the same index gives the same episodes in any batch
    ("episode", "i8"),
    ("key", "u8"),
    ("n_drawn", "u8"),
)
"""Fields that determine an environment's random numbers in a compiled world: see `random_kernels`."""
Indices = NDArray[np.integer] | NDArray[np.bool_] | Sequence[int] | slice | int
"""A selection of environments of a batch."""


def is_list(seed: Seeds) -> TypeGuard[Sequence[int | None]]:
    """Return whether ``seed`` is a sequence, with one seed for each environment."""
    if isinstance(seed, np.ndarray):
        return seed.ndim > 0
    return isinstance(seed, Sequence) and not isinstance(seed, (str, bytes))


def chosen_envs(envs: Indices, n: int) -> NDArray[np.integer]:
    """Return the indices [M] of the environments that ``envs`` selects among n."""
    try:
        return np.atleast_1d(np.arange(n)[envs])
    except IndexError as error:
        raise InputError(f"environments are numbered from 0 to {n - 1}; there is no {envs}") from error


def write_seeds(records: np.ndarray | Mapping[str, NDArray], seed: Seeds, chosen: NDArray[np.integer]) -> None:
    """Write seeds (0 to 2**63 - 1) so that the next episode is the first one of the seed.

    ``seed`` is for all chosen environments [M], or a sequence with one for each; None changes nothing.
    """
    seeds, groups = ([*seed], chosen) if is_list(seed) else ([seed], [chosen])
    if len(seeds) != len(groups):
        raise InputError(f"seeds are one for all environments or {len(chosen)} of them, not {len(seeds)}")
    given = [(group, one) for group, one in zip(groups, seeds, strict=True) if one is not None]
    for _, one in given:
        Whole(0, 2**63 - 1).check(one, "a seed")
    for group, one in given:
        records["seed"][group], records["episode"][group] = one, -1
