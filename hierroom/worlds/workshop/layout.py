"""The memory layout of workshops: the record of an environment and its things, checked before kernels use them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import InputError
from hierroom.support.schema import Array, of_records, record_type, require
from hierroom.worlds.env_config import SPLITS
from hierroom.worlds.seeds import SOURCE_FIELDS
from hierroom.worlds.workshop.kernels import BENCH, PLACES, SHELF
from hierroom.worlds.workshop.recipes import Recipes

SHOP = record_type(
    *SOURCE_FIELDS,
    ("max_steps", "i4"),
    ("split", "i4"),  # number in `SPLITS` of the set of shelf orders to draw from
    ("steps", "i4"),
    ("achieved", "i8"),  # bit g: goal g was achieved in this episode
    ("has_ended", "?"),
)


@dataclass(frozen=True)
class WorkshopState:
    """The exact state of N workshops: records [N] of `SHOP` and things [N, 3, T]."""

    shops: np.ndarray
    things: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.shops)

    def __getitem__(self, indices) -> WorkshopState:
        """Copy the state of some environments; an integer index gives a batch of one."""
        chosen = np.atleast_1d(np.arange(len(self))[indices])
        return WorkshopState(self.shops[chosen], self.things[chosen])


_INT32, _INT64 = 2**31 - 1, 2**63 - 1


def check_state(state: WorkshopState, recipes: Recipes, n: int) -> None:
    """Check that all values of a state of n workshops are in range and consistent."""
    shops, things = state.shops, state.things
    n_things, n_places = len(recipes.limits), len(recipes.standing)
    if not isinstance(shops, np.ndarray) or shops.dtype != SHOP or shops.shape != (n,):
        raise InputError(f"the workshops of a state must be an array [{n}] of records of layout.SHOP")
    bounds = {
        "seed": (0, _INT64),
        "index": (0, _INT64),
        "episode": (0, _INT64 - 1),
        "max_steps": (1, _INT32),
        "split": (0, len(SPLITS) - 1),
        "steps": (0, _INT32),
        "achieved": (0, 2**recipes.n_goals - 1),
    }
    of_records(SHOP, n, bounds).check({name: shops[name] for name in SHOP.names or ()}, "workshops")
    Array(np.uint8, (n, 3, n_things)).check(things, "things")
    counts = things[:, SHELF].astype(np.int64) + things[:, BENCH]
    has_place = np.isin(np.arange(n_things), recipes.standing)
    is_done = counts[:, recipes.target] > 0
    require(
        {
            "each thing that a recipe asks for has one place": (
                np.sort(things[:, PLACES, :n_places], axis=1) == recipes.standing
            ).all(axis=1),
            "there are no other places": ~things[:, PLACES, n_places:].any(axis=1),
            "of no thing are there more than its limit": (counts <= recipes.limits).all(axis=1),
            "the bench holds only what has a place": ~things[:, BENCH][:, ~has_place].any(axis=1),
            "the bench holds no more than it has room for": things[:, BENCH].sum(axis=1, dtype=int) <= recipes.room,
            "an episode has ended with the target or after its last step, and nowhere else": shops["has_ended"]
            == (is_done | (shops["steps"] >= shops["max_steps"])),
        },
        "the state of workshops",
    )
