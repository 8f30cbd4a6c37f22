"""Rules as recipes of a workshop: things, and integer arrays of what each recipe asks for, uses and gives."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierroom.goals import Rules
from hierroom.goals.goal_set import MAX_GOALS
from hierroom.support.arrays import freeze
from hierroom.support.errors import InputError

MAX_COUNT = 254
MAX_THINGS = 127
"""A workshop stores things and counts in bytes; larger counts that a recipe asks for are stored as 255."""


class Recipes(NamedTuple):
    """Arrays of A recipes and T things; the P things that recipes ask for have a place on the shelf.

    Args:
        asks: [A, T] uint8, counts that must be on the bench.
        uses: [A, T] uint8, counts that are used up.
        gives: [A, T] uint8, counts that are made.
        goals: [A] int64, the goal of each recipe, ascending.
        limits: [T] uint8, the largest count of each thing.
        start: [T] uint8, the count of each thing at the start of an episode.
        standing: [P] uint8, the things that have a place on the shelf.
        order: int64, the things with a depth above 0, the deepest first.
        depths: [T] int64, how many things must be made one after the other to get the thing, itself included; 0 if it
            cannot be made.
        way_depths: [A] int64, the same for a thing made by this recipe.
        target: the thing that ends the episode.
        room: how many things the bench can hold, which is the most that a recipe asks for.
        last_goal: the first goal with a recipe for the target; any recipe for the target achieves it.
        n_goals: the number of goals.
    """

    asks: NDArray[np.uint8]
    uses: NDArray[np.uint8]
    gives: NDArray[np.uint8]
    goals: NDArray[np.int64]
    limits: NDArray[np.uint8]
    start: NDArray[np.uint8]
    standing: NDArray[np.uint8]
    order: NDArray[np.int64]
    depths: NDArray[np.int64]
    way_depths: NDArray[np.int64]
    target: int
    room: int
    last_goal: int
    n_goals: int


class Book(NamedTuple):
    """The recipes of rules, with the names of their things [T]."""

    rules: Rules
    things: tuple[str, ...]
    recipes: Recipes

    def __reduce__(self) -> tuple[Any, tuple[Rules]]:
        """Let copies share the recipes, which are read-only."""
        return book_of, (self.rules,)


@lru_cache(maxsize=64)
def book_of(rules: Rules) -> Book:
    """Return the recipes of rules.

    A recipe asks for the things that its alternative needs and uses (the larger count of the two). If it would ask for
    nothing, or for the same as another goal's recipe, it also asks for its own source, such as ``source of wood``. A
    source is there from the start and is never used up.
    """
    if len(rules.names) > MAX_GOALS:
        raise InputError(f"a workshop has at most {MAX_GOALS} rules, one for each goal, not {len(rules.names)}")
    for fact, count in rules.capacity.items():
        if count > MAX_COUNT:
            raise InputError(f"a workshop holds at most {MAX_COUNT} of a thing; the capacity of {fact!r} is {count:,}")
    asks_of: dict[tuple[int, tuple[int, ...]], int] = {}  # the first alternative of a goal with this ask
    for goal, n in enumerate(rules.n_alternatives):
        for way in range(n):
            asks_of.setdefault((goal, tuple(rules.required[goal, way].tolist())), way)
    ways = [(goal, way) for (goal, _), way in asks_of.items()]
    asked = [ask for _, ask in asks_of]
    n_asking = Counter(asked)
    has_source = [not any(ask) or n_asking[ask] > 1 for ask in asked]
    with_source = sorted({goal for (goal, _), has_one in zip(ways, has_source, strict=True) if has_one})
    things = rules.facts + tuple(_free_name(f"source of {rules.names[goal]}", rules.facts) for goal in with_source)
    if len(things) > MAX_THINGS:
        raise InputError(f"a workshop holds at most {MAX_THINGS} kinds of things, not {len(things)}")

    def table(counts: NDArray[np.int64]) -> NDArray[np.uint8]:
        rows = np.zeros((len(ways), len(things)), np.uint8)
        rows[:, : len(rules.facts)] = [np.minimum(counts[way], MAX_COUNT + 1) for way in ways]
        return rows

    asks, gives, source = table(rules.required), table(rules.given), np.ones(len(with_source), np.int64)
    for row, (goal, _) in enumerate(ways):
        if has_source[row]:
            asks[row, len(rules.facts) + with_source.index(goal)] = 1
    limits, start = np.concatenate([rules.limits, source]), np.concatenate([rules.start_marking, source])
    order, depths, way_depths = _depths(asks, gives, limits, start)
    target = rules.facts.index(rules.target)
    if not depths[target]:
        raise InputError(f"no order of the rules makes the target {rules.target!r}: something that it takes is missing")
    goals = np.array([goal for goal, _ in ways])
    recipes = Recipes(
        asks=asks,
        uses=table(rules.used),
        gives=gives,
        goals=goals,
        limits=limits.astype(np.uint8),
        start=start.astype(np.uint8),
        standing=np.flatnonzero(asks.any(axis=0)).astype(np.uint8),
        order=order,
        depths=depths,
        way_depths=way_depths,
        target=target,
        room=int(asks.sum(axis=1, dtype=np.int64).max()),
        last_goal=int(goals[gives[:, target] > 0][0]),
        n_goals=len(rules.names),
    )
    freeze(recipes._asdict())  # shared by all workshops of the process
    return Book(rules, things, recipes)


def _free_name(name: str, taken: Sequence[str]) -> str:
    while name in taken:
        name += "'"
    return name


def _depths(
    asks: NDArray, gives: NDArray, limits: NDArray, start: NDArray
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the fields order, depths and way_depths of `Recipes`, by a fixpoint over AND and OR."""
    n_ways, n_things = asks.shape
    depths, way_depths = np.zeros(n_things, np.int64), np.zeros(n_ways, np.int64)
    is_known, depth = start > 0, 0
    while True:
        depth += 1
        possible = (way_depths == 0) & ((asks == 0) | (is_known & (asks <= limits))).all(axis=1)
        if not possible.any():
            break
        way_depths[possible] = depth
        made = gives[possible].any(axis=0)
        depths[made & (depths == 0)] = depth
        is_known = is_known | made
    made = np.flatnonzero(depths)
    return made[np.argsort(-depths[made], kind="stable")], depths, way_depths
