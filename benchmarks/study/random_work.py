"""The steps that random play takes in a workshop, computed exactly.

Every primitive action has the chance 1 / (places + 2), and episodes have no limit. What lies on the bench matters only
while it can still become a recipe that changes something; all other benches are one state, which clearing leaves. So
from each marking (how many there are of each thing) a small absorbing chain says which recipe is made next and after
how many steps. With b its transient states, Q among them and R into recipes, its row for the empty bench is

    steps t = ((I - Q)^-1 1)_empty,   next recipe p = ((I - Q)^-1 R)_empty,

and the mean until the target solves m = t + P m over the markings, where P leads from a marking to those after its
recipes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import spsolve

from hierroom.worlds.workshop.recipes import Recipes

Counts = tuple[int, ...]
EMPTY, BAD = 0, 1
"""The first states of a bench: nothing on it, and what no recipe can become of."""


def random_steps(recipes: Recipes) -> float:
    """Return the mean number of primitive actions until random play makes the target for the first time."""
    start = tuple(recipes.start.tolist())
    numbers, moves, steps = {start: 0}, [], []
    for marking in numbers_of(numbers):
        if marking[recipes.target]:
            steps.append(0.0)
            continue
        mean, chances = next_recipe(recipes, np.array(marking))
        steps.append(mean)
        for after, chance in chances.items():
            moves.append((numbers[marking], numbers.setdefault(after, len(numbers)), chance))
    rows, columns, chances = zip(*moves, strict=True)
    n = len(numbers)
    among = sp.csc_matrix((chances, (rows, columns)), shape=(n, n))
    mean: Any = spsolve(sp.identity(n, format="csc") - among, np.array(steps))  # the stub has matrices only
    return float(mean[0])


def numbers_of(numbers: Mapping[Counts, int]):
    """Yield the keys of a dict that grows while they are worked on, in the order in which they came."""
    done = 0
    while done < len(numbers):
        fresh = [*numbers][done:]
        done += len(fresh)
        yield from fresh


def next_recipe(recipes: Recipes, marking: NDArray[np.int64]) -> tuple[float, dict[Counts, float]]:
    """Return the mean steps from an empty bench until something is made, and the chance of each marking after it."""
    after = {}
    for way in range(len(recipes.goals)):
        asks = recipes.asks[way].astype(np.int64)
        change = recipes.gives[way].astype(np.int64) - recipes.uses[way]
        result = tuple(np.minimum(marking + change, recipes.limits).tolist())
        if (asks <= marking).all() and result != tuple(marking.tolist()):
            after.setdefault(tuple(asks.tolist()), result)  # of two alike the first is made
    if not after:
        return np.inf, {}
    empty = (0,) * len(marking)
    states = {empty: EMPTY, (): BAD}
    results, n_actions = list(dict.fromkeys(after.values())), len(recipes.standing) + 2
    moves, made = [], []
    for bench in numbers_of(states):
        state = states[bench]
        moves.append((state, EMPTY))  # clear
        if bench == ():
            moves += [(state, state)] * (n_actions - 1)
            continue
        if bench in after:
            made.append((state, results.index(after[bench])))  # work
        else:
            moves.append((state, state))
        for thing in recipes.standing.tolist():
            more = tuple(count + (thing == other) for other, count in enumerate(bench))
            if sum(more) > recipes.room or more[thing] > marking[thing]:
                more = bench
            elif not any(all(map(int.__le__, more, asks)) for asks in after):
                more = ()
            moves.append((state, states.setdefault(more, len(states))))
    stay, leave = np.zeros((len(states), len(states))), np.zeros((len(states), 1 + len(results)))
    np.add.at(stay, tuple(np.transpose(moves)), 1 / n_actions)
    np.add.at(leave, tuple(np.transpose([(state, 1 + result) for state, result in made])), 1 / n_actions)
    leave[:, 0] = 1.0
    mean, *chances = np.linalg.solve(np.eye(len(states)) - stay, leave)[EMPTY].tolist()
    return mean, dict(zip(results, chances, strict=True))
