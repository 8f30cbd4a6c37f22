"""Every goal graph of a number of rooms."""

from __future__ import annotations

from hierroom.goals.canonical import canonical_rooms
from hierroom.goals.graph import GoalGraph
from hierroom.support.errors import InputError


def enumerate_graphs(n_rooms: int) -> list[GoalGraph]:
    """List every goal graph with ``n_rooms`` rooms once, up to renaming: all rooted trees with a marked exit room.

    Their number is the coefficient of x^n in T(x)^2 / (1 - T(x)), where T counts rooted trees (OEIS A000081): from two
    rooms on 1, 3, 9, 26, 75, 214, 612, ...

    Args:
        n_rooms: number of rooms, at least 2.
    """
    if n_rooms < 2:
        raise InputError(f"a goal graph must have at least 2 rooms, not {n_rooms}")
    trees: set[tuple[int, ...]] = {()}
    for size in range(1, n_rooms):
        trees = {canonical_rooms((*tree, parent), None)[0] for tree in trees for parent in range(size)}
    graphs = {canonical_rooms(tree, exit_room) for tree in trees for exit_room in range(1, n_rooms)}
    return [GoalGraph(*graph) for graph in sorted(graphs)]
