"""Places of nodes in drawings: sets of open doors are in rows by size, and symmetric sets are drawn once."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from itertools import groupby, permutations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierroom.complexity.augmented import AugmentedGraph, Node, kinds_of_nodes
from hierroom.goals import GoalGraph
from hierroom.goals.drawing import tree_places
from hierroom.support.errors import InputError

MAX_DRAWN_NODES = 250
SPACING, PADDING, GAP, LEAST_WIDTH, LINE = 1.2, 0.8, 0.6, 2.6, 4.0
"""In units of the drawing: distance of neighbouring nodes, padding of a box, gap between boxes, least width of a box,
and distance between lines of boxes."""
ROOM_ROW, KEY_ROW = 0.55, -1.0
"""Heights of the rooms and keys of a box, relative to its line."""
COLUMN, LEAST_ROW, TEXT_LINE = 2.4, 2.0, 0.3
"""In units of a drawing of rules: distance of nodes in a row, least distance of rows, and height of a line of text."""
LONGEST_LINE = 34.0
"""Width at which a row of boxes continues on the next line."""

Point = tuple[float, float]
"""(x, y) in units of the drawing."""


class Place(NamedTuple):
    """A node of the drawing."""

    node: Node  # the first of the equivalent nodes that are drawn here
    count: int  # number of these nodes in the box
    at: Point


class Box(NamedTuple):
    """A set of open doors."""

    doors: tuple[int, ...]  # the first of the equivalent sets that are drawn here
    count: int  # number of these sets
    rooms: tuple[Place, ...]  # the exit's room last
    keys: tuple[Place, ...]
    exit_at: Point | None  # None if the exit cannot be reached from here
    corner: Point  # left and bottom
    size: Point  # width and height
    is_meshed: bool  # whether there are several rooms and each leads to every other


class _Contents(NamedTuple):
    doors: tuple[int, ...]
    count: int
    rooms: list[tuple[Node, int]]
    keys: list[tuple[Node, int]]
    has_exit: bool

    @property
    def width(self) -> float:
        most = max(len(self.rooms), len(self.keys) + self.has_exit)
        return max(SPACING * (most - 1) + 2 * PADDING, LEAST_WIDTH)


def place_augmented(augmented: AugmentedGraph) -> list[Box]:
    """Place the augmented graph: a box for each class of equivalent sets of open doors."""
    moves, boxes, line = augmented.moves, [], 0
    for _, row in groupby(_all_contents(augmented), key=lambda contents: len(contents.doors)):
        for together in _lines(row):
            left = -(sum(one.width for one in together) + GAP * (len(together) - 1)) / 2
            for one in together:
                boxes.append(_box(one, moves, left, -LINE * line))
                left += one.width + GAP
            line += 1
    return boxes


def _all_contents(augmented: AugmentedGraph) -> list[_Contents]:
    exit_room, kinds = augmented.graph.exit_room, kinds_of_nodes(augmented)
    if len(kinds) > MAX_DRAWN_NODES:
        raise InputError(
            f"a drawing can show at most {MAX_DRAWN_NODES} nodes that differ; the augmented graph of "
            f"{augmented.graph.name} has {len(kinds)}"
        )
    kind_of = {augmented.nodes[i]: kind for kind, alike in enumerate(kinds) for i in alike}

    def counted(nodes: list[Node]) -> list[tuple[Node, int]]:
        alike: dict[int, list[Node]] = {}
        for node in sorted(nodes, key=lambda node: (node.kind, node.room) == ("room", exit_room)):
            alike.setdefault(kind_of[node], []).append(node)
        return [(same[0], len(same)) for same in alike.values()]

    alike_sets = Counter(kind_of[Node("room", 0, doors)] for doors in augmented.levels)
    contents = []
    for doors in augmented.levels:
        kind = kind_of[Node("room", 0, doors)]
        if kind in alike_sets:
            rooms = counted([Node("room", room, doors) for room in (0, *doors)])
            keys = counted([Node("key", room, doors) for room in augmented.keys_in_reach(doors)])
            contents.append(_Contents(doors, alike_sets.pop(kind), rooms, keys, exit_room in doors))
    return contents


def _box(contents: _Contents, moves: set[tuple[Node, Node]], left: float, middle: float) -> Box:
    doors, count, rooms, keys, has_exit = contents
    all_rooms = [Node("room", room, doors) for room in (0, *doors)]
    centre = left + contents.width / 2
    first_room = centre - SPACING * (len(rooms) - 1) / 2
    first_key = centre - SPACING * (len(keys) + has_exit - 1) / 2
    exit_x = first_key + SPACING * len(keys) if keys else first_room + SPACING * (len(rooms) - 1)
    return Box(
        doors,
        count,
        tuple(Place(*one, (first_room + SPACING * n, middle + ROOM_ROW)) for n, one in enumerate(rooms)),
        tuple(Place(*one, (first_key + SPACING * n, middle + KEY_ROW)) for n, one in enumerate(keys)),
        (exit_x, middle + KEY_ROW) if has_exit else None,
        (left, middle + KEY_ROW - PADDING),
        (contents.width, ROOM_ROW - KEY_ROW + 2.2 * PADDING),
        len(all_rooms) > 1 and all(pair in moves for pair in permutations(all_rooms, 2)),
    )


def _lines(row: Iterable[_Contents]) -> list[list[_Contents]]:
    lines: list[list[_Contents]] = []
    length = LONGEST_LINE
    for contents in row:
        if length + contents.width + GAP > LONGEST_LINE:
            lines.append([])
            length = 0.0
        lines[-1].append(contents)
        length += contents.width + GAP
    return lines


def place_goals(graph: GoalGraph) -> dict[str, Point]:
    """Place keys and doors in rows, by the tree of keys; the exit is placed like one more room."""
    places: dict[str, Point] = {}
    for room, (column, depth) in enumerate(tree_places((*graph.key_rooms, graph.exit_room))):
        x, door, key = 1.5 * column, -3.2 * depth, 1.6 - 3.2 * depth
        if room == 0:
            places["start"] = (x, door)
        elif room == graph.n_rooms:
            places["exit"] = (x, key)
        else:
            places |= {f"key {room}": (x, key), f"door {room}": (x, door)}
    return places


def place_rows(rows: NDArray[np.floating], edges: NDArray[np.integer], n_lines: int) -> list[Point]:
    """Place nodes in rows, each below its predecessors; unreachable nodes come last."""
    last = max([row for row in rows.tolist() if math.isfinite(row)], default=0.0) + 1
    height = max(LEAST_ROW, 1.2 + TEXT_LINE * (n_lines + 1))
    places: dict[int, Point] = {}
    for row in sorted({min(row, last) for row in rows.tolist()}):
        nodes = [node for node, own in enumerate(rows.tolist()) if min(own, last) == row]
        above = {node: [places[i][0] for i, j in edges.tolist() if j == node and i in places] for node in nodes}
        nodes.sort(key=lambda node: float(np.mean(above[node])) if above[node] else 0.0)
        for n, node in enumerate(nodes):
            places[node] = (COLUMN * (n - (len(nodes) - 1) / 2), -height * row)
    return [places[node] for node in range(len(rows))]


def limits(points: Iterable[Point]) -> tuple[Point, Point]:
    """Return (left, right) and (bottom, top) of a drawing, with a margin around the outermost points."""
    xs, ys = zip(*points, strict=True)
    middle, half = (min(xs) + max(xs)) / 2, max((max(xs) - min(xs)) / 2 + 1.2, 2.4)  # 2.4: the title fits
    return (middle - half, middle + half), (min(ys) - 1.2, max(ys) + 1.5)
