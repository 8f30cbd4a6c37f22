"""EscapeRooms of the arena: goal graphs of six and seven rooms that no committed run has seen.

They were drawn at random with seed 73, and not chosen by any measure. Sizes, limits and whether keys can be dropped (a
sixth action) were shuffled by themselves, so that they do not change together.
"""

_DRAWN = {
    "keys-0-0-1-2-2-exit-3": (19, 1000, False),
    "keys-0-0-1-2-4-exit-3": (23, 400, False),
    "keys-0-1-1-3-3-exit-2": (15, 300, True),
    "keys-0-1-1-3-4-exit-2": (19, 500, False),
    "keys-0-0-0-0-0-exit-1": (15, 700, False),
    "keys-0-1-2-3-4-exit-5": (19, 700, False),
    "keys-0-0-0-0-1-5-exit-1": (15, 1000, True),
    "keys-0-0-0-2-2-2-exit-1": (23, 300, False),
}
TASKS = {
    graph: {"graph": graph, "size": size, "max_steps": limit, "drop_key": drop}
    for graph, (size, limit, drop) in _DRAWN.items()
}
