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
from hierroom.worlds.workshop.kernels import write_observations
from hierroom.worlds.workshop.layout import BENCH, SHELF, SHOP
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
    def legal_goals(self) -> tuple[Goal, ...]:
        """The goals that the meta-controller may choose; empty if only 'no goal' is legal."""
        return tuple(goal for goal in self.goals if goal.is_legal)

    def __str__(self) -> str:
        legal = ", ".join(map(str, self.legal_goals)) or "none"
        return f"step {self.steps}; shelf: {in_words(self.shelf)}; bench: {in_words(self.bench)}; legal goals: {legal}"


def in_words(counts: Mapping[str, int]) -> str:
    """Return how many there are of each thing that is there: ``2 wood, tree``."""
    return ", ".join(f"{n} {thing}" if n > 1 else thing for thing, n in counts.items() if n) or "nothing"


@dataclass(frozen=True, eq=False)
class WorkshopView:
    """The view of M workshops: records of `layout.SHOP` and ``things`` [M, 3, T]; see `layout`."""

    book: Book
    solver: Solver
    shops: np.ndarray
    things: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.shops)

    def as_dict(self) -> dict[str, NDArray]:
        """Return the observation's entries, in fresh arrays.

        Returns:
            ``observation`` [M, P, 3] uint8: of each place of the shelf, the thing that stands there, how many there
            are of it to take, and how many lie on the bench.
        """
        observations = np.empty((len(self), len(self.book.recipes.standing), 3), np.uint8)
        _compiled_observations()(self.things, observations)
        return {"observation": observations}

    def uniforms(self, turns: NDArray[np.integer], n: int) -> NDArray[np.float64]:
        """Return [M, n] random numbers in [0, 1), fixed by seed, environment, episode and turn [M]."""
        uniforms = np.empty((len(self), n))
        turn_uniforms(self.shops, turns, uniforms)
        return uniforms

    def goals_by(self, mask: str) -> NDArray[np.bool_]:
        """Return the goals [M, G] that a goal mask allows on the meta-controller's turn."""
        return legal_goals(self.book, self.shops, self.things, mask, np.ones(len(self), bool))[:, :-1]

    @cached_property
    def reachable(self) -> NDArray[np.bool_]:
        """[M, G] goals that can be made now and change something."""
        return self.goals_by("reachable")

    @property
    def seen(self) -> NDArray[np.bool_]:
        """[M, G] the same: nothing is hidden."""
        return self.reachable

    @cached_property
    def depth_first_ranks(self) -> NDArray[np.int64]:
        """[M, G] how near to the target each goal stands among those that the way there lacks; else 0."""
        ranks = np.empty((len(self), self.book.recipes.n_goals), np.int64)
        _compiled_ranks()(self.things, self.book.recipes, ranks)
        return ranks

    @property
    def oracle_goals(self) -> NDArray[np.int64]:
        """[M] the goal achieved first on a shortest way to the target, or -1."""
        ways = [self.solver.next_way(things)[1] for things in self.things]
        return np.array([-1 if way < 0 else self.book.recipes.goals[way] for way in ways], np.int64)

    def level(self, m: int, legal: NDArray[np.bool_]) -> Workshop:
        """Return the m-th environment in words; ``legal`` [G] are the goals that may be chosen."""
        achieved, reachable = int(self.shops["achieved"][m]), self.reachable[m].tolist()
        goals = tuple(
            Goal(g, name, reachable[g], bool(legal[g]), bool(achieved >> g & 1))
            for g, name in enumerate(self.book.rules.names)
        )
        shelf, bench = (
            dict(zip(self.book.things, self.things[m, row].tolist(), strict=True)) for row in (SHELF, BENCH)
        )
        return Workshop(goals, shelf, bench, int(self.shops["steps"][m]))


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


@cache
def _compiled_observations() -> Callable[..., None]:
    bytes_ = np.zeros((1, 3, 1), np.uint8)
    return compiled(write_observations, bytes_, bytes_)


@cache
def _compiled_ranks() -> Callable[..., None]:
    recipes = book_of(tech_tree(2)).recipes
    return compiled(write_ranks, np.zeros((1, 3, 1), np.uint8), recipes, np.zeros((1, 1), np.int64))
