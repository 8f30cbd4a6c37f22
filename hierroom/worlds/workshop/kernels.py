"""Compiled kernels with the rules of the workshop, for one environment and for a batch.

A shop is a record of `layout.SHOP`; ``things`` are its rows `PLACES`, `SHELF` and `BENCH`. With ``NUMBA_DISABLE_JIT=1``
the same source runs as ordinary Python.
"""

import numpy as np

from hierroom.support.kernel import copy_matrix, njit
from hierroom.worlds.random_kernels import GOLDEN, mix, shuffle, stream_key

PLACES, SHELF, BENCH = range(3)
"""Rows of things [3, T]: the thing at each place of the shelf, and the counts of each thing on the shelf and bench."""
MIN_SPLIT_PLACES = 5
"""With fewer places on the shelf there are too few orders to keep some for evaluation."""


@njit(cache=True)
def begin(shop, things, recipes):
    """Begin the next episode: everything on the shelf, in a random order that the shop's split allows."""
    shop.episode += 1
    shop.key = stream_key(shop.seed, shop.index, shop.episode)
    shop.n_drawn = np.uint64(0)
    shop.steps, shop.achieved, shop.has_ended = 0, 0, False
    things[:] = 0
    for thing in range(recipes.start.shape[0]):
        things[SHELF, thing] = recipes.start[thing]
    n_places = recipes.standing.shape[0]
    order = things[PLACES, :n_places]
    for place in range(n_places):
        order[place] = recipes.standing[place]
    shuffle(shop, order)
    while shop.split and n_places >= MIN_SPLIT_PLACES and is_held_out(order) != (shop.split == 2):
        shuffle(shop, order)


@njit(cache=True)
def is_held_out(order):
    """Return whether an order of the shelf is kept for evaluation; a hash selects an eighth of all orders."""
    digest = np.uint64(0)
    for thing in order:
        digest = mix(digest + np.uint64(thing) + GOLDEN)
    return digest >> np.uint64(61) == 0


@njit(cache=True)
def put(things, place, room):
    """Put the thing at a place of the shelf on the bench, if there is one and the bench has room for it."""
    thing, on_bench = things[PLACES, place], 0
    for count in things[BENCH]:
        on_bench += count
    if things[SHELF, thing] and on_bench < room:
        things[SHELF, thing] -= 1
        things[BENCH, thing] += 1


@njit(cache=True)
def work(things, recipes):
    """Apply the recipe on the bench and return its goal; return -1 if there is none or it changes nothing."""
    for way in range(recipes.goals.shape[0]):
        is_laid = True
        for thing in range(things.shape[1]):
            if things[BENCH, thing] != recipes.asks[way, thing]:
                is_laid = False
                break
        if is_laid:
            return recipes.goals[way] if apply(things, recipes, way) else -1
    return -1


@njit(cache=True)
def apply(things, recipes, way):
    """Apply a recipe to all things, on the shelf and on the bench; return False if it changes no count."""
    if not changes(things, recipes, way):
        return False
    for thing in range(things.shape[1]):
        things[SHELF, thing] = count_after(things, recipes, way, thing)
        things[BENCH, thing] = 0
    return True


@njit(cache=True)
def changes(things, recipes, way):
    """Return whether a recipe would change the count of any thing."""
    for thing in range(things.shape[1]):
        if count_after(things, recipes, way, thing) != np.int64(things[SHELF, thing]) + things[BENCH, thing]:
            return True
    return False


@njit(cache=True)
def count_after(things, recipes, way, thing):
    """Return the count of a thing after a recipe, cut at its limit."""
    count = np.int64(things[SHELF, thing]) + np.int64(things[BENCH, thing])
    count += np.int64(recipes.gives[way, thing]) - np.int64(recipes.uses[way, thing])
    return min(count, np.int64(recipes.limits[thing]))


@njit(cache=True)
def clear(things):
    """Put everything on the bench back on the shelf."""
    for thing in range(things.shape[1]):
        things[SHELF, thing] += things[BENCH, thing]
        things[BENCH, thing] = 0


@njit(cache=True)
def note_goal(shop, things, recipes, goal, outcome):
    """Record an achieved goal, and with it the target's goal if the target was made."""
    outcome.achieved = 1 << goal
    if things[SHELF, recipes.target]:
        outcome.achieved |= 1 << recipes.last_goal
        outcome.reward, outcome.terminated = 1.0, True
    new = outcome.achieved & ~shop.achieved
    while new:
        outcome.n_first += 1
        new &= new - 1
    shop.achieved |= outcome.achieved


@njit(cache=True, nogil=True)
def begin_shops(shops, things, recipes):
    """Begin the next episode in every environment."""
    for n in range(shops.shape[0]):
        begin(shops[n], things[n], recipes)


@njit(cache=True, nogil=True)
def step_shops(shops, things, recipes, actions, outcomes, last_shops, last_things, autoreset):
    """Act once in every environment; an action that does not apply only costs the step.

    Where an episode ends, ``autoreset`` stores its last state and begins the next one. Without it, ended environments
    and their flags stay unchanged. (There is no function for one environment, because passing all recipes to it takes
    longer than the step.)
    """
    n_places = recipes.standing.shape[0]
    for n in range(shops.shape[0]):
        shop, outcome, action = shops[n], outcomes[n], actions[n]
        outcome.achieved, outcome.n_first, outcome.reward = 0, 0, 0.0
        if shop.has_ended:
            continue
        outcome.terminated = False
        if 0 <= action < n_places:
            put(things[n], action, recipes.room)
        elif action == n_places:
            goal = work(things[n], recipes)
            if goal >= 0:
                note_goal(shop, things[n], recipes, goal, outcome)
        elif action == n_places + 1:
            clear(things[n])
        shop.steps += 1
        outcome.truncated = shop.steps >= shop.max_steps
        outcome.length = shop.steps
        shop.has_ended = outcome.terminated or outcome.truncated
        if shop.has_ended and autoreset:
            last_shops[n] = shop
            copy_matrix(things[n], last_things[n])
            begin(shop, things[n], recipes)


@njit(cache=True, nogil=True)
def write_observations(things, observations):
    """Write observations [M, P, 3]: the thing at each place, its count on the shelf and its count on the bench."""
    for m in range(observations.shape[0]):
        for place in range(observations.shape[1]):
            thing = things[m, PLACES, place]
            observations[m, place, 0] = thing
            observations[m, place, 1] = things[m, SHELF, thing]
            observations[m, place, 2] = things[m, BENCH, thing]
