"""Workshops whose goals form a chain: each thing is made of the thing before it and of wood, which it uses up.

``chain_8`` has eight goals: wood, seven things, the last of which is the target. Wood must be made anew for each.
"""

from __future__ import annotations

import hierroom
from hierroom.worlds.workshop.task import WorkshopTask

LENGTHS = (4, 8, 12, 16, 20, 24)


def chain(n_goals: int) -> WorkshopTask:
    """Return the workshop of a chain of 3 or more goals."""
    rules: dict[str, dict] = {"wood": {"needs": "tree", "gives": "wood"}}
    rules["thing 2"] = {"uses": {"wood": 2}, "gives": "thing 2"}
    for k in range(3, n_goals + 1):
        rules[f"thing {k}"] = {"uses": [f"thing {k - 1}", "wood"], "gives": f"thing {k}"}
    capacity, start = {"wood": 2}, {"tree": 1}
    return hierroom.workshop(hierroom.Rules(rules, f"thing {n_goals}", capacity, start, f"chain of {n_goals}"))


chain_4, chain_8, chain_12, chain_16, chain_20, chain_24 = map(chain, LENGTHS)
