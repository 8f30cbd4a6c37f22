"""The shortest solution of a workshop: the fewest primitive actions until the target is made.

A recipe of k things takes k actions to fill the bench and one to work. So the search runs on markings (the counts of
all things), and an edge costs k + 1. It is A* with the bound `Solver._bound`; the step limit is ignored. Things already
on the bench save actions of the first recipe, or cost one action to clear the bench.
"""

from __future__ import annotations

import heapq

import numpy as np
from numpy.typing import NDArray

from hierroom.worlds.workshop.kernels import apply, clear
from hierroom.worlds.workshop.layout import BENCH, PLACES, SHELF
from hierroom.worlds.workshop.recipes import Recipes

MAX_MARKINGS = 100_000
"""Most markings that a search expands; if these are not enough, the shortest length is unknown."""
Marking = tuple[int, ...]


def _things(counts: NDArray[np.uint8]) -> set[int]:
    return {*np.flatnonzero(counts).tolist()}


class Solver:
    """Finds shortest solutions, and caches them."""

    def __init__(self, recipes: Recipes) -> None:
        self._recipes = recipes
        relevant, ways = {recipes.target}, set()
        while True:
            more = {way for way in np.flatnonzero(recipes.way_depths) if relevant & _things(recipes.gives[way])} - ways
            if not more:
                break
            ways |= more
            relevant = relevant.union(*(_things(recipes.asks[way]) for way in more))
        self._relevant = np.array(sorted(relevant))
        self._target = sorted(relevant).index(recipes.target)
        self._ways = sorted(ways)
        asks, uses, gives = (t[:, self._relevant].astype(np.int64) for t in (recipes.asks, recipes.uses, recipes.gives))
        self._limits = recipes.limits[self._relevant].tolist()
        self._rows = {
            way: ([(t, n) for t, n in enumerate(asks[way].tolist()) if n], (gives[way] - uses[way]).tolist())
            for way in self._ways
        }
        self._costs = {way: int(asks[way].sum()) + 1 for way in self._ways}
        self._makers = self._find_makers(asks, uses, gives)
        self._known: dict[Marking, tuple[int, int]] = {}  # marking: cost to the target, next way

    def _find_makers(self, asks: NDArray, uses: NDArray, gives: NDArray) -> list[tuple]:
        """Return what each thing that can be made takes at least, the deepest thing first.

        Each row has the thing, the most of it that a way gives, and the least cost (0 if a way also gives other
        things). Last comes a list: for each less deep thing, the least that all ways ask for and use.
        """
        makers, depths = [], self._recipes.depths[self._relevant]
        for thing in np.argsort(-depths, kind="stable"):
            ways = [way for way in self._ways if gives[way, thing]]
            if not ways:
                continue
            is_alone = all((gives[way] > 0).sum() == 1 for way in ways)
            cost = min(self._costs[way] for way in ways) * is_alone
            nearer = (asks[ways].min(axis=0) > 0) & (depths < depths[thing])
            takes = [(o, int(asks[ways, o].min()), int(uses[ways, o].min()) * is_alone) for o in np.flatnonzero(nearer)]
            makers.append((int(thing), int(gives[ways, thing].max()), cost, takes))
        return makers

    def _bound(self, marking: Marking) -> int:
        """Return a lower bound of the cost to the target.

        The target must be made, and so must its missing ingredients, theirs, and so on, as often as they are used up.
        Only ingredients that all recipes of a thing take count, and only if they are less deep than the thing.
        """
        at_once, in_all, cost = [0] * len(marking), [0] * len(marking), 0
        at_once[self._target] = 1
        for thing, given, one_cost, takes in self._makers:
            lack = max(at_once[thing], in_all[thing]) - marking[thing]
            if lack > 0:
                times = -(-lack // given)
                cost += times * one_cost
                for other, asked, used in takes:
                    at_once[other] = max(at_once[other], asked)
                    in_all[other] += used * times
        return cost

    def _applied(self, way: int, marking: Marking) -> Marking | None:
        asked, change = self._rows[way]
        if any(marking[thing] < count for thing, count in asked):
            return None
        after = tuple(map(min, map(int.__add__, marking, change), self._limits))
        return None if after == marking else after

    def _solve(self, start: Marking) -> tuple[int, int]:
        """Return the least cost from a marking to the target and the first way there; -1 if none is known."""
        if start in self._known or start[self._target]:
            return self._known.get(start, (0, -1))
        costs, came_from = {start: 0}, {}
        queue, n_left, marking = [(self._bound(start), 0, start)], MAX_MARKINGS, start
        while queue and n_left:
            _, minus_cost, marking = heapq.heappop(queue)
            if -minus_cost > costs[marking]:
                continue
            if marking[self._target]:
                break
            n_left -= 1
            for way in self._ways:
                after = self._applied(way, marking)
                if after is not None and costs[marking] + self._costs[way] < costs.get(after, np.inf):
                    costs[after] = costs[marking] + self._costs[way]
                    came_from[after] = marking, way
                    heapq.heappush(queue, (costs[after] + self._bound(after), -costs[after], after))
        else:
            self._known[start] = -1, -1
            return -1, -1
        total = costs[marking]
        while marking != start:
            marking, way = came_from[marking]
            self._known[marking] = total - costs[marking], way
        return self._known[start]

    def next_way(self, things: NDArray[np.uint8]) -> tuple[int, int]:
        """Return the fewest actions from things [3, T] to the target, and the recipe to make first.

        The number is 0 if the target is there, and -1 if no solution is known. In both cases the recipe is -1.
        """
        on_bench = things[BENCH].astype(np.int64)
        marking = tuple((things[SHELF] + on_bench)[self._relevant].tolist())
        found = self._solve(marking)
        if found[1] < 0 or not on_bench.any():
            return found
        best = found[0] + 1, found[1]  # clear the bench first
        for way in self._ways:
            after = self._applied(way, marking)
            if after is not None and (on_bench <= self._recipes.asks[way]).all():
                rest, _ = self._solve(after)
                if rest >= 0:
                    best = min(best, (rest + self._costs[way] - int(on_bench.sum()), way))
        return best

    def actions(self, things: NDArray[np.uint8]) -> NDArray[np.int64]:
        """Return a shortest sequence of actions from things [3, T] to the target; empty if none is known."""
        n_places, recipes = len(self._recipes.standing), self._recipes
        places, actions = things[PLACES, :n_places].tolist(), []
        things, (left, way) = things.copy(), self.next_way(things)
        while left > 0:
            asked = recipes.asks[way]
            if (things[BENCH] > asked).any():
                actions.append(n_places + 1)
                clear(things)
            for thing in np.flatnonzero(asked - things[BENCH]).tolist():
                actions += [places.index(thing)] * int(asked[thing] - things[BENCH, thing])
            actions.append(n_places)
            apply(things, recipes, way)
            left, way = self.next_way(things)
        return np.array(actions, np.int64)
