"""Crafter by symbols: achievements that random play can reach are the targets, and its own ``data.yaml`` the rules.

    pip install crafter numba

Symbols are not pixels, and rules are not learned: no number of these tasks is compared with Crafter's public table.
"""

import hierroom
from examples.tasks.crafter_symbols import Crafter, rules

_CAPACITY = {"collect_wood": 2, "collect_stone": 4}
_LIMITS = {
    "collect_wood": 200,
    "collect_drink": 500,
    "place_plant": 300,
    "eat_cow": 500,
    "defeat_zombie": 1000,
    "place_table": 400,
    "make_wood_sword": 1000,
    "make_wood_pickaxe": 500,
    "collect_stone": 1000,
}


def achieve(target, max_steps):
    """Return the task of an achievement: it, and what is needed for it, are the goals."""
    every, needed, found = rules(), [target], []
    while needed:
        name = needed.pop()
        asked = every[name].get("needs", ())
        needed += [asked] if isinstance(asked, str) else asked
        needed += every[name].get("uses", ())
        found.append(name)
    order = [name for name in every if name in found]
    return hierroom.Task(
        Crafter,
        {name: lambda env, info, name=name: info["achievements"][name] for name in order},
        {name: every[name] for name in order},
        target,
        max_steps,
        capacity={name: n for name, n in _CAPACITY.items() if name in order},
        symbols=["view"],
    )


TASKS = {name: achieve(name, limit) for name, limit in _LIMITS.items()}
globals().update(TASKS)  # runs name a task like benchmarks.arena.crafter_symbols:eat_cow
