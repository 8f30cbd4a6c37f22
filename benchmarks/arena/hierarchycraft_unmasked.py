"""HierarchyCraft's worlds without the mask of legal actions, with which random play wins, and with shorter limits.

    pip install hcraft

An action that is not possible does nothing. This family was added after the runs of `hierarchycraft`, and comes last.
"""

from dataclasses import replace

from hcraft.examples.minicraft import MiniHCraftBlockedUnlockPickup, MiniHCraftKeyCorridor, MiniHCraftMultiRoom

from benchmarks.arena.hierarchycraft import recursive, tower
from examples.tasks.hierarchycraft import task_of

_MASKED = {
    "blocked_unlock_pickup": task_of(MiniHCraftBlockedUnlockPickup, "get box, get weight", 200),
    "key_corridor": task_of(MiniHCraftKeyCorridor, "get ball, get weight", 150),
    "rooms": task_of(MiniHCraftMultiRoom, "get goal", 200),
    "recursive_8": task_of(recursive(8), "get 7", 800),
    "recursive_7": task_of(recursive(7), "get 6", 400),
    "light_recursive_10": task_of(recursive(10, 2), "get 9", 500),
    "light_recursive_8": task_of(recursive(8, 3), "get 7", 400),
    "tower_3_3": task_of(tower(3, 3), "get 9", 200),
    "tower_4_3": task_of(tower(4, 3), "get 12", 400),
    "tower_2_6": task_of(tower(2, 6), "get 12", 200),
}
TASKS = {name: replace(task, action_mask="") for name, task in _MASKED.items()}
globals().update(TASKS)  # runs name a task like benchmarks.arena.hierarchycraft_unmasked:rooms
