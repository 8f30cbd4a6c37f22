"""The view of M workshops, and a workshop in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from hierroom.support.compile.kernel import compiled
from hierroom.worlds.random_kernels import turn_uniforms
from hierroom.worlds.workshop.goal_kernels import GOAL_MASKS, write_masks, write_ranks
from hierroom.worlds.workshop.layout import BENCH, PLACES, SHELF, SHOP
from hierroom.worlds.workshop.recipes import Book, book_of
from hierroom.worlds.workshop.shortest import Solver
from hierroom.worlds.workshop.tech_tree import tech_tree


@dataclass(frozen=True)
class Goal:
    """A goal of a workshop: its ``id``, its ``name``, and whether it can be made now, is legal, and was achieved."""

    id: int
    name: str
    is_reachable: bool
    is_legal: bool
    was_achieved: bool

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True)
class Workshop:
    """One workshop in words: all goals by id, how many there are of each thing on the shelf and on the bench."""

    goals: tuple[Goal, ...]
    shelf: Mapping[str, int]
    bench: Mapping[str, int]
    steps: int

    @property
    def legal_goals(
    book: Book, shops: np.ndarray, things: NDArray[np.uint8], mask: str, are_turns: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return the meta-controllers' legal actions [M, G + 1] under one of `GOAL_MASKS`; off turn they can only wait."""
    masks = np.empty((len(shops), book.recipes.n_goals + 1), bool)
    _compiled_masks()(shops, things, book.recipes, np.ascontiguousarray(are_turns), GOAL_MASKS[mask], masks)
    return masks


@cache
def _compiled_masks() -> Callable[..., None]:
    things, recipes = np.zeros((1, 3, 1), np.uint8), book_of(tech_tree(2)).recipes
    return compiled(write_masks, np.zeros(1, SHOP), things, recipes, np.zeros(1, bool), 1, np.zeros((1, 1), bool))
