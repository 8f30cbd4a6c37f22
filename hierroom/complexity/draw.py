"""Drawings of a goal graph and its augmented graph: one row per number of open doors, as in the paper's appendix.

The exit is a single node of the augmented graph. It is drawn once for every set of open doors from which it can be
reached, so that no edge has to cross the whole picture.
"""

from __future__ import annotations

import io
from collections.abc import Iterable
from pathlib import Path

import matplotlib.colors as mcolors
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from hierroom.complexity.augmented import AugmentedGraph, Node
from hierroom.errors import InputError
from hierroom.files import write_atomically
from hierroom.goals import GoalGraph

MAX_DRAWN_NODES = 250
INCHES, SPACING, ROW, PADDING, LEAST_WIDTH = 0.6, 1.2, 4.4, 0.8, 2.3
"""Inches per unit of the drawing; in units, the distance between nodes, the distance between rows, and the margin and
least width of the box around each set of open doors."""
ROOM_ROW, KEY_ROW = 0.75, -0.85
"""Heights of the rooms and keys of a set of open doors, relative to the middle of its box."""

ROOM_COLOURS = ("#d9d9d9", "#4c8bf5", "#b565d8", "#f28e2b", "#e15759", "#17a2b8", "#c9a400", "#8c6d5a", "#7a8b99")
"""Colours of the start and of rooms 1, 2, ...; a key has the colour of the room it opens."""
EXIT_COLOUR = "#35a853"
INK, FAINT = "#333333", "#9a9a9a"

CAPTION = (
    "circles: rooms    squares: keys    two heads: both ways    exit: one node, drawn wherever it is reached\n"
    "not drawn: staying, and the restart that leads from every node to the start"
)

Point = tuple[float, float]
"""(x, y) in units of the drawing."""


def draw_graph(augmented: AugmentedGraph, path: str | Path) -> None:
    """Draw the goal graph next to the augmented graph and write the picture to a file.

    Args:
        augmented: the augmented graph, which includes its goal graph.
        path: the file; its suffix selects the format: .png, .pdf, .svg, ...; without a suffix .png is added.

    Raises:
        InputError: if the graph is too large to be readable, the suffix is unknown, or the file cannot be written.
    """
    if len(augmented.nodes) > MAX_DRAWN_NODES:
        raise InputError(
            f"a drawing can show at most {MAX_DRAWN_NODES} nodes; the augmented graph of {augmented.graph.name} has "
            f"{len(augmented.nodes)}"
        )
    places = _places(augmented)
    width, height = _extent(places.values())
    goal_places = _goal_places(augmented.graph)
    goal_width, goal_height = _extent(goal_places.values())
    figure = Figure(
        figsize=((width + goal_width) * INCHES, (max(height, goal_height) + 1) * INCHES), layout="constrained"
    )
    left, right = figure.subplots(1, 2, width_ratios=[goal_width, width])
    _draw_goal_graph(left, augmented.graph, goal_places)
    _draw_augmented(right, augmented, places)
    figure.supxlabel(CAPTION, fontsize=8, color=INK)
    path = Path(path)
    if not path.suffix:
        path = path.with_name(f"{path.name}.png")
    picture = io.BytesIO()
    try:
        figure.savefig(picture, format=path.suffix[1:], dpi=150, facecolor="white")
    except ValueError as error:  # matplotlib does not know the suffix; its message lists those it knows
        raise InputError(f"cannot write the drawing {path}: {error}") from error
    write_atomically(path, picture.getvalue())


def _draw_goal_graph(axes: Axes, graph: GoalGraph, places: dict[str, Point]) -> None:
    """Draw the start at the top, and below each node what it makes possible: keys, their doors, and the exit."""
    title = f"goal graph {graph.name}\n{graph.n_rooms} rooms, exit depth {graph.exit_depth}, width {graph.width}"
    _prepare(axes, title, places.values())
    unlocked = graph.to_networkx()
    for source, target in unlocked.edges:
        _arrow(axes, places[source], places[target], EXIT_COLOUR if target == "exit" else INK)
    for name, node in unlocked.nodes.items():
        paint = _square if node["kind"] == "key" else _circle
        paint(axes, places[name], EXIT_COLOUR if name == "exit" else _colour_of(node["room"]), name.replace(" ", "\n"))


def _goal_places(graph: GoalGraph) -> dict[str, Point]:
    """Place leaves of the tree of keys side by side, keys and doors in rows, parents centred above children."""
    children: list[list[int]] = [[] for _ in range(graph.n_rooms)]
    for room, key_room in enumerate(graph.key_rooms, start=1):
        children[key_room].append(room)
    places: dict[str, Point] = {}
    columns: dict[int, float] = {}
    n_leaves = 0
    for room in _deepest_first(children):
        slots = [columns[child] for child in children[room]]
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


def _draw_augmented(axes: Axes, augmented: AugmentedGraph, places: dict[Node, Point]) -> None:
    drop = "with" if augmented.drop_key else "without"
    size = f"{len(augmented.nodes)} nodes, {len(augmented.edges)} edges"
    _prepare(axes, f"augmented graph, {drop} drop\n{size}", places.values())
    moves = {(augmented.nodes[i], augmented.nodes[j]) for i, j in augmented.edges.tolist()}
    for source, target in sorted(moves):
        is_two_way = (target, source) in moves
        if target.kind == "exit" or (is_two_way and target < source):
            continue  # the exit is drawn separately; moves in both directions are one arrow with two heads
        _draw_move(axes, source, target, places, is_two_way)
    for doors in augmented.levels:
        _draw_level(axes, augmented, doors, places)
    for node, place in places.items():
        if node.kind == "key":
            _square(axes, place, _colour_of(node.room), f"k{node.room}")
        elif node.kind == "exit":
            _arrow(axes, places[Node("room", node.room, node.doors)], place, EXIT_COLOUR, width=1.8)
            _circle(axes, place, EXIT_COLOUR, "exit")
        else:
            _circle(axes, place, _colour_of(node.room), "start" if node.room == 0 else f"r{node.room}")


def _draw_move(axes: Axes, source: Node, target: Node, places: dict[Node, Point], is_two_way: bool) -> None:
    start, end = places[source], places[target]
    style = "<|-|>" if is_two_way else "-|>"
    if source.kind == "key" and target.doors != source.doors:
        _arrow(axes, start, end, _colour_of(source.room), width=1.8)
    elif source.kind == target.kind == "room":
        gap = round(abs(start[0] - end[0]) / SPACING)
        bend = 0.0 if gap == 1 else -0.28 - 0.04 * gap
        _arrow(axes, min(start, end), max(start, end), FAINT, style, bend)
    else:
        _arrow(axes, start, end, FAINT, style)


def _draw_level(axes: Axes, augmented: AugmentedGraph, doors: tuple[int, ...], places: dict[Node, Point]) -> None:
    inside = [place for node, place in places.items() if node.doors == doors]
    left, right = min(x for x, _ in inside) - PADDING, max(x for x, _ in inside) + PADDING
    slack = max(0.0, LEAST_WIDTH - (right - left)) / 2
    left, right = left - slack, right + slack
    top = places[Node("room", 0, doors)][1] + 1.1 + 0.16 * len(doors)
    bottom = min(y for _, y in inside) - PADDING
    axes.add_patch(
        FancyBboxPatch(
            (left, bottom), right - left, top - bottom, boxstyle="round,pad=0,rounding_size=0.3",
            facecolor="#f6f6f6", edgecolor="#cccccc", linewidth=1, zorder=0,
        )
    )  # fmt: skip
    n_closed = augmented.graph.n_rooms - 1 - len(doors)
    name = "all doors closed" if not doors else f"open: {', '.join(map(str, doors))}" if n_closed else "all doors open"
    patch = {"facecolor": "#f6f6f6", "edgecolor": "none", "pad": 1.0}
    axes.text(left + 0.18, top - 0.15, name, fontsize=9, va="top", color=INK, zorder=5, bbox=patch)


def _places(augmented: AugmentedGraph) -> dict[Node, Point]:
    """Place the sets of open doors in rows by size, with an exit node for each set that leads to the exit."""
    rows: list[list[tuple[int, ...]]] = [[] for _ in range(augmented.graph.n_rooms)]
    for doors in augmented.levels:
        rows[len(doors)].append(doors)
    exit_room = augmented.graph.exit_room
    places: dict[Node, Point] = {}
    for n_open, row in enumerate(rows):
        levels = []
        for doors in row:
            rooms = [Node("room", room, doors) for room in (0, *doors)]
            keys = [Node("key", room, doors) for room in augmented.keys_in_reach(doors)]
            levels.append((rooms, keys + [Node("exit", exit_room, doors)] * (exit_room in doors)))
        widths = [max(SPACING * (max(map(len, level)) - 1) + 2 * PADDING, LEAST_WIDTH) for level in levels]
        x = -(sum(widths) + 0.6 * (len(row) - 1)) / 2
        for level, width in zip(levels, widths, strict=True):
            for nodes, lift in zip(level, (ROOM_ROW, KEY_ROW), strict=True):
                first = x + width / 2 - SPACING * (len(nodes) - 1) / 2
                if [node.kind for node in nodes] == ["exit"]:  # no keys left: directly below its room
                    first = places[Node("room", exit_room, nodes[0].doors)][0]
                places |= {node: (first + SPACING * i, lift - ROW * n_open) for i, node in enumerate(nodes)}
            x += width + 0.6
    return places


def _deepest_first(children: list[list[int]], room: int = 0) -> list[int]:
    return [*(below for child in children[room] for below in _deepest_first(children, child)), room]


def _extent(places: Iterable[Point]) -> Point:
    """Width and height of a drawing, including a margin around the outermost nodes."""
    (left, right), (bottom, top) = _limits(places)
    return right - left, top - bottom


def _limits(places: Iterable[Point]) -> tuple[Point, Point]:
    xs, ys = zip(*places, strict=True)
    middle, half = (min(xs) + max(xs)) / 2, max((max(xs) - min(xs)) / 2 + 1.2, 2.4)  # 2.4: the title fits
    return (middle - half, middle + half), (min(ys) - 1.2, max(ys) + 1.5)


def _prepare(axes: Axes, title: str, places: Iterable[Point]) -> None:
    """Set the title and the limits of a drawing, with the same scale in both directions."""
    axes.set_title(title, parse_math=False, fontsize=11, color=INK)
    axes.set_aspect("equal", anchor="N")
    horizontal, vertical = _limits(places)
    axes.set_xlim(*horizontal)
    axes.set_ylim(*vertical)
    axes.axis("off")


def _colour_of(room: int) -> str:
    """The colour of a room and of the key that opens it; after the ninth the room colours repeat."""
    return ROOM_COLOURS[room] if room < len(ROOM_COLOURS) else ROOM_COLOURS[1 + (room - 1) % (len(ROOM_COLOURS) - 1)]


def _circle(axes: Axes, place: Point, colour: str, text: str) -> None:
    """Draw a room, a door or the exit."""
    _node(axes, place, colour, text, "o", 760)


def _square(axes: Axes, place: Point, colour: str, text: str) -> None:
    """Draw a key."""
    _node(axes, place, colour, text, "s", 620)


def _node(axes: Axes, place: Point, colour: str, text: str, marker: str, size: float) -> None:
    axes.scatter(*place, s=size, marker=marker, color=colour, edgecolors=INK, linewidths=1.0, zorder=3)
    ink = "white" if mcolors.rgb_to_hsv(mcolors.to_rgb(colour))[1] > 0.3 else INK
    axes.text(*place, text, fontsize=8.5, ha="center", va="center", color=ink, weight="bold", zorder=4)


def _arrow(
    axes: Axes, start: Point, end: Point, colour: str, style: str = "-|>", bend: float = 0.0, width: float = 1.1
) -> None:
    """Draw an arrow between the rims of two nodes; ``bend`` is its sideways curvature as a fraction of its length."""
    axes.add_patch(
        FancyArrowPatch(
            start, end, arrowstyle=style, mutation_scale=11, color=colour, linewidth=width, zorder=2,
            connectionstyle=f"arc3,rad={bend}", shrinkA=15, shrinkB=15,
        )
    )  # fmt: skip
