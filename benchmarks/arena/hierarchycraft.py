"""HierarchyCraft's worlds, with items and zones as targets; their transformations are the rules.

    pip install hcraft

MineHcraft is not among them: as every zone can give way to every other one, a log of wood would have 48 goals.
"""

from functools import partial

from hcraft.examples import LightRecursiveHcraftEnv, RecursiveHcraftEnv, TowerHcraftEnv
from hcraft.examples.minicraft import (
    MiniHCraftBlockedUnlockPickup,
    MiniHCraftKeyCorridor,
    MiniHCraftMultiRoom,
)

from examples.tasks.hierarchycraft import task_of


def tower(height, width):
    """Return the maker of a tower whose own limit, which is its shortest solution, does not count."""
    return partial(TowerHcraftEnv, height=height, width=width, max_step=10**6)


def recursive(n, before=None):
    """Return the maker of n items, each of which uses up all before it, or some."""
    if before is None:
        return partial(RecursiveHcraftEnv, n_items=n)
    return partial(LightRecursiveHcraftEnv, n_items=n, n_required_previous=before)


TASKS = {
    "blocked_unlock_pickup": task_of(MiniHCraftBlockedUnlockPickup, "get box, get weight", 400),
    "key_corridor": task_of(MiniHCraftKeyCorridor, "get ball, get weight", 200),
    "rooms": task_of(MiniHCraftMultiRoom, "get goal", 300),
    "recursive_6": task_of(recursive(6), "get 5", 500),
    "recursive_7": task_of(recursive(7), "get 6", 1000),
    "light_recursive_8": task_of(recursive(8, 3), "get 7", 500),
    "light_recursive_10": task_of(recursive(10, 2), "get 9", 800),
    "tower_3_3": task_of(tower(3, 3), "get 9", 300),
    "tower_4_2": task_of(tower(4, 2), "get 8", 200),
    "tower_2_6": task_of(tower(2, 6), "get 12", 200),
}
globals().update(TASKS)  # runs name a task like benchmarks.arena.hierarchycraft:rooms
