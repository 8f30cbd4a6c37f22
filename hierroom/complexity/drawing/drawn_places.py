"""Where the nodes of drawings stand: sets of open doors in rows by size, equivalent ones drawn once.

A renaming of rooms that preserves the goal graph maps sets of open doors to others. One of each class is drawn, with
the number of sets it stands for; in it, rooms or keys that the renaming exchanges are likewise one.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from hierroom.complexity.augmented import AugmentedGraph, Node, kinds_of_nodes
from hierroom.goals import GoalGraph

SPACING, PADDING, GAP, LEAST_WIDTH, LINE = 1.2, 0.8, 0.6, 2.6, 4.0
"""In units of the drawing: between nodes side by side, around the nodes of a box, between boxes, the least width of a
box, and between lines of boxes."""
ROOM_ROW, KEY_ROW = 0.55, -1.0
"""Heights of the rooms and keys of a box, relative to its line."""
LONGEST_LINE = 34.0
"""Width at which a row of boxes continues in a line below."""

Point = tuple[float, float]
"""(x, y) in units of the drawing."""


@dataclass(frozen=True)
class Place:
    """A node of the drawing."""

    node: Node  # the first of the nodes that it stands for
    count: int  # how many of them the box holds
    at: Point  # its place


@dataclass(frozen=True)
class Box:
    """A set of open doors."""

    doors: tuple[int, ...]  # the first of the sets that it stands for
    count: int  # how many sets it stands for
    rooms: tuple[Place, ...]  # its rooms, that of the exit last
    keys: tuple[Place, ...]  # its keys
    exit_at: Point | None  # the place of the exit; None if it cannot be reached from here
    corner: Point  # left and bottom
    size: Point  # width and height
    is_meshed: bool  # whether each of several rooms leads to every other


def place_augmented(augmented: AugmentedGraph) -> list[Box]:
    """Place the augmented graph: a box for each class of equivalent sets of open doors."""
    kinds = kinds_of_nodes(augmented)
    kind_of = {i: kind for kind, nodes in enumerate(kinds) for i in nodes}
    moves = set(map(tuple, augmented.edges.tolist()))
    alike: dict[int, list[tuple[int, ...]]] = {}  # by the kind of their start room
    for doors in augmented.levels:
        alike.setdefault(kind_of[augmented.index[Node("room", 0, doors)]], []).append(doors)
    rows: list[list[list[tuple[int, ...]]]] = [[] for _ in range(augmented.graph.n_rooms)]
    for sets in alike.values():
        rows[len(sets[0])].append(sets)
    boxes, line = [], 0
    for row in rows:
        for sets_of_line in _lines(row, augmented, kind_of):
            widths = [_width(sets[0], augmented, kind_of) for sets in sets_of_line]
            left = -(sum(widths) + GAP * (len(widths) - 1)) / 2
            for sets, width in zip(sets_of_line, widths, strict=True):
                boxes.append(_box(sets, augmented, kind_of, moves, (left, -LINE * line), width))
                left += width + GAP
            line += 1
    return boxes


def _box(
    sets: list[tuple[int, ...]],
    augmented: AugmentedGraph,
    kind_of: dict[int, int],
    moves: set[tuple[int, ...]],
    corner: Point,
    width: float,
) -> Box:
    doors, (left, middle) = sets[0], corner
    rooms, keys = _contents(doors, augmented, kind_of)
    all_rooms = [augmented.index[Node("room", room, doors)] for room in (0, *doors)]
    has_exit = augmented.graph.exit_room in doors
    first_room = left + width / 2 - SPACING * (len(rooms) - 1) / 2
    first_key = left + width / 2 - SPACING * (len(keys) + has_exit - 1) / 2
    exit_x = first_key + SPACING * len(keys) if keys else first_room + SPACING * (len(rooms) - 1)
    return Box(
        doors,
        len(sets),
        tuple(Place(*one, (first_room + SPACING * n, middle + ROOM_ROW)) for n, one in enumerate(rooms)),
        tuple(Place(*one, (first_key + SPACING * n, middle + KEY_ROW)) for n, one in enumerate(keys)),
        (exit_x, middle + KEY_ROW) if has_exit else None,
        (left, middle + KEY_ROW - PADDING),
        (width, ROOM_ROW - KEY_ROW + 2.2 * PADDING),
        len(all_rooms) > 1 and all((i, j) in moves for i in all_rooms for j in all_rooms if i != j),
    )


def _contents(
    doors: tuple[int, ...], augmented: AugmentedGraph, kind_of: dict[int, int]
) -> tuple[list[tuple[Node, int]], list[tuple[Node, int]]]:
    """The rooms and keys of a set of open doors, one of each kind with its number, the exit's room last."""
    found = []
    for kind, numbers in (("room", (0, *doors)), ("key", augmented.keys_in_reach(doors))):
        alike: dict[int, list[Node]] = {}
        for number in numbers:
            node = Node(kind, number, doors)
            alike.setdefault(kind_of[augmented.index[node]], []).append(node)
        nodes = [(same[0], len(same)) for same in alike.values()]
        found.append(sorted(nodes, key=lambda one: (one[0].kind, one[0].room) == ("room", augmented.graph.exit_room)))
    return found[0], found[1]


def _width(doors: tuple[int, ...], augmented: AugmentedGraph, kind_of: dict[int, int]) -> float:
    rooms, keys = _contents(doors, augmented, kind_of)
    most = max(len(rooms), len(keys) + (augmented.graph.exit_room in doors))
    return max(SPACING * (most - 1) + 2 * PADDING, LEAST_WIDTH)


def _lines(
    row: list[list[tuple[int, ...]]], augmented: AugmentedGraph, kind_of: dict[int, int]
) -> list[list[list[tuple[int, ...]]]]:
    """Cut a row where it gets too long."""
    lines: list[list[list[tuple[int, ...]]]] = []
    length = LONGEST_LINE
    for sets in row:
        width = _width(sets[0], augmented, kind_of) + GAP
        if length + width > LONGEST_LINE:
            lines.append([])
            length = 0.0
        lines[-1].append(sets)
        length += width
    return lines


def place_goals(graph: GoalGraph) -> dict[str, Point]:
    """Place leaves of the tree of keys side by side, keys and doors in rows, parents centred above children."""
    places: dict[str, Point] = {}
    columns: dict[int, float] = {}
    n_leaves = 0
    for room in _deepest_first(graph.children):
        slots = [columns[child] for child in graph.children[room]]
        if room == graph.exit_room:
            slots.append(n_leaves)
            places["exit"] = (1.5 * n_leaves, -3.2 * graph.depths[room] - 1.6)
        elif not slots:
            slots.append(n_leaves)
        n_leaves += n_leaves in slots
        columns[room] = sum(slots) / len(slots)
        x, y = 1.5 * columns[room], -3.2 * graph.depths[room]
        places |= {f"key {room}": (x, y + 1.6), f"door {room}": (x, y)} if room else {"start": (x, y)}
    return places


def limits(points: Iterable[Point]) -> tuple[Point, Point]:
    """Left and right, bottom and top of a drawing, with a margin around the outermost points."""
    xs, ys = zip(*points, strict=True)
    middle, half = (min(xs) + max(xs)) / 2, max((max(xs) - min(xs)) / 2 + 1.2, 2.4)  # 2.4: the title fits
    return (middle - half, middle + half), (min(ys) - 1.2, max(ys) + 1.5)


def _deepest_first(children: Sequence[Sequence[int]], room: int = 0) -> list[int]:
    return [*(below for child in children[room] for below in _deepest_first(children, child)), room]
