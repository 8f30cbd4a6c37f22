"""The tree of keys: its canonical order, and places to draw it."""

from __future__ import annotations

from collections.abc import Sequence


def child_rooms(key_rooms: Sequence[int]) -> tuple[tuple[int, ...], ...]:
    """Return, for each room, the rooms that have their keys in it, ascending."""
    children: list[list[int]] = [[] for _ in range(len(key_rooms) + 1)]
    for room, parent in enumerate(key_rooms, start=1):
        children[parent].append(room)
    return tuple(map(tuple, children))


def canonical_rooms(key_rooms: tuple[int, ...], exit_room: int | None) -> tuple[tuple[int, ...], int]:
    """Renumber rooms by `canonical_order`, and return the new key rooms and exit room; the latter is 0 for None."""
    order = canonical_order(key_rooms, exit_room)
    position = {room: n for n, room in enumerate(order)}
    new_key_rooms = tuple(position[key_rooms[room - 1]] for room in order[1:])
    return new_key_rooms, 0 if exit_room is None else position[exit_room]


def canonical_order(key_rooms: Sequence[int], exit_room: int | None) -> list[int]:
    """List the rooms breadth first, with the children of a room ordered by the shape of their subtrees.

    Subtrees are ranked floor by floor, the deepest first (Aho, Hopcroft & Ullman 1974). This needs no recursion.
    """
    children = child_rooms(key_rooms)
    floors = [[0]]
    while floors[-1]:
        floors.append([child for room in floors[-1] for child in children[room]])
    rank: dict[int, int] = {}  # the rank of each room's subtree on its floor; equal subtrees have equal ranks
    for floor in reversed(floors):
        shapes = {
            room: (room == exit_room, sorted((rank[child] for child in children[room]), reverse=True)) for room in floor
        }
        ranks = {shape: n for n, shape in enumerate(sorted({(own, *below) for own, below in shapes.values()}))}
        rank |= {room: ranks[own, *below] for room, (own, below) in shapes.items()}
    order = [0]
    for room in order:
        order += sorted(children[room], key=rank.__getitem__, reverse=True)
    return order


def tree_places(key_rooms: Sequence[int]) -> list[tuple[float, int]]:
    """Return (column, depth) of each room: leaves side by side, others in the middle above their children."""
    below = child_rooms(key_rooms)
    order, depths, waiting = [], [0] * len(below), [0]  # order: each room before its children, from left to right
    while waiting:
        order.append(room := waiting.pop())
        for child in below[room]:
            depths[child] = depths[room] + 1
        waiting += below[room][::-1]
    columns, n_leaves = [0.0] * len(below), 0
    for room in order:
        if not below[room]:
            columns[room], n_leaves = float(n_leaves), n_leaves + 1
    for room in reversed(order):
        if below[room]:
            columns[room] = (columns[below[room][0]] + columns[below[room][-1]]) / 2
    return list(zip(columns, depths, strict=True))
