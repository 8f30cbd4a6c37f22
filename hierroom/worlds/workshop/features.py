"""The features of a workshop, which are small whole numbers that a network reads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.worlds.workshop.layout import BENCH, PLACES, SHELF
from hierroom.worlds.workshop.recipes import Book
from hierroom.worlds.world import Feature

MOST = 3
"""Larger counts are read as this one."""
MOST_VALUES = 255


def features_of(book: Book) -> Mapping[str, Feature]:
    """Return the features of a workshop's recipes, by name.

    shelf: the thing at each place. stock, bench: the count of each thing on the shelf and on the bench. goal-shelf:
    pairs of the controller's goal and the thing at each place, so that one table row can tell that the goal takes this
    thing. goal-bench: pairs of the goal and each count on the bench. For a meta-controller, the goal is its last one.
    For each goal there are goal-status (can be made now, was achieved in this episode) and goal-wanted (the way to the
    target lacks it, by the rules).
    """
    recipes = book.recipes
    standing, n_goals = recipes.standing, recipes.n_goals
    n_places, n_things = len(standing), len(book.things)
    number_of = np.zeros(n_things, np.int64)  # index of each thing among those with a place
    number_of[standing] = np.arange(n_places)
    most = np.minimum(recipes.limits, MOST).astype(np.int64)
    levels = tuple((1 + most[standing]).tolist())

    def counts(observation: Any, *rows: int) -> NDArray[np.int64]:
        return np.minimum(sum(observation.things[:, row].astype(np.int64) for row in rows), most)

    def shelf(observation: Any) -> NDArray[np.int64]:
        return number_of[observation.things[:, PLACES, :n_places]]

    def bench(observation: Any) -> NDArray[np.int64]:
        return counts(observation, BENCH)[:, standing]

    def status(observation: Any) -> NDArray[np.int64]:
        achieved = observation.shops["achieved"][:, None] >> np.arange(n_goals) & 1
        return observation.reachable + 2 * achieved

    of_goal: dict[str, Any] = {"is_of_goal": True, "is_of_world": False}
    with_shelf, with_bench = (_Paired(n_goals, n, n_places) for n in (n_places, 1 + int(most.max())))
    return {
        "shelf": Feature((n_places,) * n_places, shelf),
        "stock": Feature(levels, lambda observation: counts(observation, SHELF)[:, standing]),
        "bench": Feature(levels, bench),
        "goal-shelf": Feature(with_shelf.cardinalities, lambda o: with_shelf.encode(o.goals, shelf(o)), **of_goal),
        "goal-bench": Feature(with_bench.cardinalities, lambda o: with_bench.encode(o.goals, bench(o)), **of_goal),
        "goal-status": Feature((4,) * n_goals, status, is_by_goal=True),
        "goal-wanted": Feature((2,) * n_goals, lambda o: o.depth_first_ranks > 0, is_by_goal=True),
    }


class _Paired:
    """Numbers that pair the goal with each of ``n`` values below ``n_values``.

    A feature has at most 256 values. So many goals are shared out among several numbers for each value. A number is 0
    while a goal of another number is pursued.
    """

    def __init__(self, n_goals: int, n_values: int, n: int) -> None:
        self._n_values = n_values
        self._share = max(1, MOST_VALUES // n_values)
        self._n_numbers = -(-(n_goals + 1) // self._share)
        self.cardinalities = (1 + self._share * self._n_values,) * (self._n_numbers * n)

    def encode(self, goals: NDArray[np.integer], values: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return [M, numbers * n] from goals [M] (-1: no goal) and values [M, n]."""
        number, place = np.divmod(goals + 1, self._share)
        pairs = 1 + place[:, None] * self._n_values + values
        is_paired = number[:, None] == np.arange(self._n_numbers)
        return (is_paired[:, :, None] * pairs[:, None, :]).reshape(len(goals), -1)
