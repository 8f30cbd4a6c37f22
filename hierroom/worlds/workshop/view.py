"""The view of M workshops."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hierroom.support.kernel import Compiled
from hierroom.worlds.base_view import GoalInWords, Situated
from hierroom.worlds.random_kernels import turn_uniforms
from hierroom.worlds.workshop.goal_kernels import GOAL_MASKS, write_masks, write_ranks
from hierroom.worlds.workshop.kernels import write_observations
from hierroom.worlds.workshop.layout import BENCH, SHELF, SHOP
from hierroom.worlds.workshop.recipes import Book, book_of
from hierroom.worlds.workshop.shortest import Solver
from hierroom.worlds.workshop.tech_tree import tech_tree


@dataclass(frozen=True, eq=False)
class WorkshopView:
    """The view of M workshops, read-only: records of `layout.SHOP` and ``things`` [M, 3, T]; see `layout`."""

    book: Book
    solver: Solver
    shops: np.ndarray
    things: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.shops)

    def as_dict(self) -> dict[str, NDArray]:
        """Return the observation's entries, in fresh arrays.

        Returns:
            ``observation`` [M, P, 3] uint8: for each place of the shelf its thing, the thing's count on the shelf and
            its count on the bench.
        """
        observations = np.empty((len(self), len(self.book.recipes.standing), 3), np.uint8)
        _OBSERVATIONS.run(self.things, observations)
        return {"observation": observations}

    def uniforms(self, turns: NDArray[np.integer], n: int) -> NDArray[np.float64]:
        """Return [M, n] random numbers in [0, 1), determined by seed, environment, episode and turn [M]."""
        uniforms = np.empty((len(self), n))
        _UNIFORMS.run(self.shops, np.ascontiguousarray(turns, np.int64), uniforms)
        return uniforms

    def legal_goals(self, mask: str, are_turns: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the legal choices [M, G + 1] under one of `GOAL_MASKS`; only 'no goal' off turn."""
        masks, recipes = np.empty((len(self), self.book.recipes.n_goals + 1), bool), self.book.recipes
        are_turns = np.ascontiguousarray(are_turns)
        _MASKS.run(self.shops, self.things, recipes, are_turns, GOAL_MASKS[mask], masks)
        return masks

    @cached_property
    def reachable(self) -> NDArray[np.bool_]:
        """Goals that can be made now and change something, [M, G]."""
        return self.legal_goals("reachable", np.ones(len(self), bool))[:, :-1]

    @property
    def seen(self) -> NDArray[np.bool_]:
        """The reachable goals [M, G], because nothing is hidden."""
        return self.reachable

    @cached_property
    def depth_first_ranks(self) -> NDArray[np.int64]:
        """Depths [M, G] of the goals that the way to the target lacks; 0 for other goals."""
        ranks = np.empty((len(self), self.book.recipes.n_goals), np.int64)
        _RANKS.run(self.things, self.book.recipes, ranks)
        return ranks

    @property
    def oracle_goals(self) -> NDArray[np.int64]:
        """First goals [M] on a shortest path to the target, or -1."""
        ways = [self.solver.next_way(things)[1] for things in self.things]
        return np.array([-1 if way < 0 else self.book.recipes.goals[way] for way in ways], np.int64)

    def level(self, m: int, legal: NDArray[np.bool_]) -> Situated:
        """Return the m-th environment in words; its facts are the things on the shelf and the bench."""
        achieved, names = int(self.shops["achieved"][m]), self.book.rules.names
        goals = (GoalInWords(g, name, bool(legal[g]), achieved >> g & 1) for g, name in enumerate(names))
        counts = self.things[m, SHELF] + self.things[m, BENCH]
        facts = dict(zip(self.book.things, counts.tolist(), strict=True))
        return Situated(tuple(goals), int(self.shops["steps"][m]), facts)


# Examples of the types to compile kernels for; read-only arrays have other types.
_SHOPS, _THINGS, _RECIPES = np.zeros(1, SHOP), np.zeros((1, 3, 1), np.uint8), book_of(tech_tree(2)).recipes
_OBSERVATIONS = Compiled(write_observations, _THINGS, _THINGS)
_UNIFORMS = Compiled(turn_uniforms, _SHOPS, np.zeros(1, np.int64), np.zeros((1, 1)))
_MASKS = Compiled(write_masks, _SHOPS, _THINGS, _RECIPES, np.zeros(1, bool), 1, np.zeros((1, 1), bool))
_RANKS = Compiled(write_ranks, _THINGS, _RECIPES, np.zeros((1, 1), np.int64))
