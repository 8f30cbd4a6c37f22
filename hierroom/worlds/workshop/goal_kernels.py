"""Kernels for the goals of a workshop: which can be made, and which the way to the target lacks."""

import numpy as np

from hierroom.support.kernel import njit
from hierroom.worlds.workshop.kernels import BENCH, SHELF, changes

REACHABLE, EXISTING, SEEN, ALL = range(4)
GOAL_MASKS = {"reachable": REACHABLE, "existing": EXISTING, "seen": SEEN, "none": ALL}
"""Legal goals by name. reachable: can be made now and change something; existing: also all not achieved yet; seen: as
reachable, as nothing is hidden, and 'no goal' is always legal; none: all goals."""


@njit(cache=True)
def can_make(things, recipes, way):
    """Return whether a recipe's ingredients are on the shelf or the bench, and it would change something."""
    for thing in range(things.shape[1]):
        if np.int64(things[SHELF, thing]) + things[BENCH, thing] < recipes.asks[way, thing]:
            return False
    return changes(things, recipes, way)


@njit(cache=True, nogil=True)
def write_masks(shops, things, recipes, are_turns, kind, masks):
    """Write the legal choices [M, G + 1] of meta-controllers.

    'No goal' is legal where no goal is, such as off turn, and under ``SEEN`` always.
    """
    n_goals = recipes.n_goals
    for m in range(shops.shape[0]):
        masks[m] = False
        if are_turns[m]:
            for way in range(recipes.goals.shape[0]):
                if can_make(things[m], recipes, way):
                    masks[m, recipes.goals[way]] = True
            for goal in range(n_goals):
                if kind == ALL or (kind == EXISTING and not shops[m].achieved >> goal & 1):
                    masks[m, goal] = True
        masks[m, n_goals] = kind == SEEN or not masks[m].any()


@njit(cache=True, nogil=True)
def write_ranks(things, recipes, ranks):
    """Write ranks [M, G]: the depths of goals that the way to the target lacks, and 0 for others.

    The target is wanted. For each wanted thing that is missing, the ingredients of its first recipe of least depth are
    wanted too. A goal's rank is the depth of the missing thing that it makes.
    """
    ranks[:] = 0
    n_things = things.shape[2]
    wanted = np.empty(n_things, np.int64)
    for m in range(things.shape[0]):
        wanted[:] = 0
        wanted[recipes.target] = 1
        for thing in recipes.order:
            if wanted[thing] <= np.int64(things[m, SHELF, thing]) + things[m, BENCH, thing]:
                continue
            depth, is_first = recipes.depths[thing], True
            for way in range(recipes.goals.shape[0]):
                if not recipes.gives[way, thing] or recipes.way_depths[way] != depth:
                    continue
                goal = recipes.goals[way]
                if is_first or can_make(things[m], recipes, way):
                    ranks[m, goal] = max(ranks[m, goal], depth)
                if is_first:
                    for other in range(n_things):
                        wanted[other] = max(wanted[other], np.int64(recipes.asks[way, other]))
                is_first = False
