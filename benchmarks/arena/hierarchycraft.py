"""HierarchyCraft's worlds, with items and zones as targets; their transformations are the rules.

    pip install hcraft

MineHcraft is not among them: as every zone can give way to every other one, a log of wood would have 48 goals.
"""

from functools import partial

from hcraft.examples import LightRecursiveHcraftEnv, RecursiveHcraftEnv, TowerHcraftEnv, TreasureEnv
from hcraft.examples.minicraft import (
    MiniHCraftBlockedUnlockPickup,
    MiniHCraftDoorKey,
    MiniHCraftKeyCorridor,
    MiniHCraftMultiRoom,
    MiniHCraftUnlockPickup,
)

from examples.tasks.hierarchycraft import task_of


def tower(height, width):
    """Return the maker of a tower whose own limit, which is its shortest solution, does not count."""
    return partial(TowerHcraftEnv, height=height, width=width, max_step=10**6)


_BOX, _BALL = "get box, get weight", "get ball, get weight"
TASKS = {
    "treasure": task_of(TreasureEnv, "get gold", 200),
    "unlock_pickup": task_of(MiniHCraftUnlockPickup, _BOX, 300),
    "blocked_unlock_pickup": task_of(MiniHCraftBlockedUnlockPickup, _BOX, 800),
    "door_key": task_of(MiniHCraftDoorKey, "get goal", 100),
    "key_corridor": task_of(MiniHCraftKeyCorridor, _BALL, 300),
    "rooms": task_of(MiniHCraftMultiRoom, "get goal", 150),
    "recursive_4": task_of(partial(RecursiveHcraftEnv, n_items=4), "get 3", 100),
    "light_recursive_6": task_of(partial(LightRecursiveHcraftEnv, n_items=6), "get 5", 500),
    "tower_2_3": task_of(tower(2, 3), "get 6", 200),
    "tower_3_2": task_of(tower(3, 2), "get 6", 500),
}
globals().update(TASKS)  # runs name a task like benchmarks.arena.hierarchycraft:treasure
