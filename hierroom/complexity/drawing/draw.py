"""Drawings of a goal graph and its augmented graph: one row per number of open doors, as in the paper's appendix.

The exit is drawn in each set of open doors from which it can be reached, so that no edge crosses the picture.
"""

from __future__ import annotations

import io
import textwrap
from collections.abc import Sequence
from pathlib import Path

import matplotlib.colors as mcolors
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from hierroom.complexity.augmented import AugmentedGraph, Node, kinds_of_nodes
from hierroom.complexity.drawing.drawn_places import (
    PADDING,
    SPACING,
    Box,
    Place,
    Point,
    limits,
    place_augmented,
    place_goals,
)
from hierroom.goals import GoalGraph
from hierroom.support.errors import InputError
from hierroom.support.files import usable_path, write_atomically

PICTURE_FORMATS = (".png", ".pdf", ".svg")
INCHES, MOST_INCHES, LEAST_SCALE = 0.6, 14.0, 0.55
"""Inches per unit of the drawing, the size above which a drawing is shrunk, and the least scale that can be read."""
LEAST_WIDTH, HUGE = 2.88, 150.0
"""Inches: the width in which a title fits, and the size above which a drawing is shrunk below the least scale."""

ROOM_COLOURS = ("#d9d9d9", "#4c8bf5", "#b565d8", "#f28e2b", "#e15759", "#17a2b8", "#c9a400", "#8c6d5a", "#7a8b99")
"""Colours of the start and of rooms 1, 2, ...; a key has the colour of the room it opens."""
EXIT_COLOUR = "#35a853"
INK, FAINT = "#333333", "#9a9a9a"


def draw_goal_graph(graph: GoalGraph, axes: Axes, scale: float = 1.0) -> None:
    """Draw a goal graph onto an Axes: the start at the top, and below each node the nodes that it makes possible."""
    places = place_goals(graph)
    title = f"goal graph {graph.name}\n{graph.n_rooms} rooms, exit depth {graph.exit_depth}, width {graph.width}"
    pen = Pen(axes, scale, title, list(places.values()))
    unlocked = graph.to_networkx()
    for source, target in unlocked.edges:
        pen.arrow(places[source], places[target], EXIT_COLOUR if target == "exit" else INK)
    for name, node in unlocked.nodes.items():
        colour = EXIT_COLOUR if name == "exit" else _colour_of(node["room"])
        pen.node(places[name], colour, name.replace(" ", "\n"), is_key=node["kind"] == "key")


def draw_augmented(augmented: AugmentedGraph, axes: Axes, scale: float = 1.0) -> None:
    """Draw an augmented graph onto an Axes; `caption` explains the drawing."""
    boxes = place_augmented(augmented)
    drop = "with" if augmented.drop_key else "without"
    size = f"{len(augmented.nodes)} nodes, {len(augmented.edges)} edges"
    pen = Pen(axes, scale, f"augmented graph, {drop} drop\n{size}", _corners(boxes))
    kinds = {i: kind for kind, nodes in enumerate(kinds_of_nodes(augmented)) for i in nodes}
    entrances = {kinds[augmented.index[room.node]]: room.at for box in boxes for room in box.rooms}
    moves = augmented.moves
    for box in boxes:
        _draw_box(pen, augmented, box)
        _draw_moves(pen, box, moves)
        for key in box.keys:
            opened = Node("room", key.node.room, tuple(sorted((*box.doors, key.node.room))))
            pen.arrow(key.at, entrances[kinds[augmented.index[opened]]], _colour_of(key.node.room), width=1.8)
        for place in (*box.rooms, *box.keys):
            pen.node(place.at, _colour_of(place.node.room), _name(place.node), place.node.kind == "key", place.count)
        if box.exit_at is not None:
            pen.arrow(box.rooms[-1].at, box.exit_at, EXIT_COLOUR, width=1.8)
            pen.node(box.exit_at, EXIT_COLOUR, "exit")


def caption(augmented: AugmentedGraph) -> str:
    """Return the text that explains the symbols of `draw_augmented` and names what is not drawn."""
    walk = augmented.walk
    lines = ["circles: rooms    squares: keys    exit: one node, drawn wherever it is reached    two heads: both ways"]
    lines.append("grey band: each of its rooms leads to every other; an arrow at a band is one at each of its rooms")
    if augmented.drop_key:
        lines.append("drop: the second head of a grey arrow at a key, back to the rooms where the key may be put down")
    if len(kinds_of_nodes(augmented)) < len(augmented.nodes):
        lines.append("x 3: three that differ only in the numbers of rooms, drawn once")
    lines.append(
        f"not drawn: staying, a self-loop at every node ({walk.stay:g}), "
        f"and the restart from every node to the start ({walk.restart:g})"
    )
    return "\n".join(lines)


def picture_file(path: str | Path) -> Path:
    """Check the path for `save_figure`, before a long computation, and return it with a suffix."""
    path = usable_path(path)
    if path.is_dir():
        raise InputError(f"a drawing is a file, not the folder {path}")
    if not path.suffix:
        path = path.with_name(f"{path.name}.png")
    if path.suffix.lower() not in PICTURE_FORMATS:
        raise InputError(f"drawings are written as {', '.join(PICTURE_FORMATS)}, not as {path.name or path}")
    if not path.parent.is_dir():
        raise InputError(f"cannot write {path}: there is no folder {path.parent}")
    return path


def save_figure(figure: Figure, path: str | Path) -> None:
    """Write a figure atomically to a .png (the default), .pdf or .svg file."""
    path, picture = picture_file(path), io.BytesIO()
    figure.savefig(picture, format=path.suffix[1:].lower(), dpi=150, facecolor="white")
    write_atomically(path, picture.getvalue())


def figure_of_graph(augmented: AugmentedGraph) -> Figure:
    """Return the figure of a goal graph next to its augmented graph."""
    drawn = list(place_goals(augmented.graph).values()), _corners(place_augmented(augmented))
    figure, (left, right), scale = figure_for(drawn)
    draw_goal_graph(augmented.graph, left, scale)
    draw_augmented(augmented, right, scale)
    figure.supxlabel(caption(augmented), fontsize=8 * max(scale, 0.7), color=INK, parse_math=False)
    return figure


def figure_for(drawn: Sequence[Sequence[Point]]) -> tuple[Figure, Sequence[Axes], float]:
    """Return a figure with an Axes for the points of each drawing, side by side, and the scale of its symbols."""
    spans = [limits(points) for points in drawn]
    widths = [right - left for (left, right), _ in spans]
    whole = sum(widths) * INCHES, (max(top - bottom for _, (bottom, top) in spans) + 2) * INCHES
    scale = min(1.0, max(MOST_INCHES / max(whole), min(LEAST_SCALE, HUGE / max(whole))))
    width = max(whole[0] * scale, LEAST_WIDTH)
    figure = Figure(figsize=(width, whole[1] * scale), layout="constrained")
    return figure, figure.subplots(1, len(drawn), width_ratios=widths, squeeze=False)[0], scale


def fold(text: str, width: float, size: float) -> str:
    """Break the lines of a text of a size in points that are wider than ``width``, in units of the drawing."""
    most = int(width * INCHES * 72 / (0.6 * size))  # characters, which are 0.6 times as wide as high on average
    return "\n".join(textwrap.fill(line, most) for line in text.split("\n"))


def _draw_box(pen: Pen, augmented: AugmentedGraph, box: Box) -> None:
    (left, bottom), (_, height) = box.corner, box.size
    pen.patch(box.corner, box.size, "#f6f6f6", "#cccccc", 0)
    if box.is_meshed:
        xs = [place.at[0] for place in (*box.rooms, *box.keys)]
        y, half = box.rooms[0].at[1], 0.48
        pen.patch((min(xs) - half, y - half), (max(xs) - min(xs) + 2 * half, 2 * half), "#e3e3e3", FAINT, 1)
    n_closed = augmented.graph.n_rooms - 1 - len(box.doors)
    doors = ", ".join(map(str, box.doors))
    name = "all doors closed" if not doors else f"open: {doors}" if n_closed else "all doors open"
    pen.text((left + 0.14, bottom + height - 0.12), name + (f"  x {box.count}" if box.count > 1 else ""))


def _draw_moves(pen: Pen, box: Box, moves: set[tuple[Node, Node]]) -> None:
    all_rooms = [Node("room", room, box.doors) for room in (0, *box.doors)]
    for key in box.keys:
        has_all = all((room, key.node) in moves for room in all_rooms)
        returns = [(key.node, room) in moves for room in all_rooms]
        if box.is_meshed and has_all and (all(returns) or not any(returns)):
            below = (key.at[0], box.rooms[0].at[1] - 0.48)
            pen.arrow(below, key.at, FAINT, "<|-|>" if all(returns) else "-|>", shrink=0.0)
            continue
        for room in box.rooms:
            _draw_pair(pen, room, key, moves, 0.0)
    for i, room in enumerate(box.rooms if not box.is_meshed else ()):
        for other in box.rooms[i + 1 :]:
            gap = round(abs(room.at[0] - other.at[0]) / SPACING)
            _draw_pair(pen, room, other, moves, 0.0 if gap == 1 else -0.28 - 0.04 * gap)


def _draw_pair(pen: Pen, one: Place, other: Place, moves: set[tuple[Node, Node]], bend: float) -> None:
    there, back = (one.node, other.node) in moves, (other.node, one.node) in moves
    if there or back:
        pen.arrow(one.at, other.at, FAINT, "<|-|>" if there and back else "-|>" if there else "<|-", bend)


def _name(node: Node) -> str:
    return f"k{node.room}" if node.kind == "key" else f"r{node.room}" if node.room else "start"


def _corners(boxes: list[Box]) -> list[Point]:
    corners = []
    for box in boxes:
        (left, bottom), (width, height) = box.corner, box.size
        corners += [(left + PADDING, bottom + PADDING), (left + width - PADDING, bottom + height - PADDING)]
    return corners


def _colour_of(room: int) -> str:
    return ROOM_COLOURS[room and 1 + (room - 1) % (len(ROOM_COLOURS) - 1)]


class Pen:
    """Draws nodes, arrows, boxes and text onto an Axes, with limits that fit the given points."""

    def __init__(self, axes: Axes, scale: float, title: str, points: list[Point]) -> None:
        self.axes, self.scale = axes, scale
        horizontal, vertical = limits(points)
        size = 11 * max(scale, 0.7)
        title = fold(title, (horizontal[1] - horizontal[0]) * max(scale, LEAST_SCALE), size)
        axes.set_title(title, parse_math=False, fontsize=size, color=INK)
        axes.set_aspect("equal", anchor="N")
        axes.set_xlim(*horizontal)
        axes.set_ylim(*vertical)
        axes.axis("off")

    def node(self, place: Point, colour: str, name: str, is_key: bool = False, count: int = 1) -> None:
        """Draw a circle, or a square for a key, and the number of equivalent nodes if it stands for several."""
        marker, size = ("s", 620) if is_key else ("o", 760)
        lines = self.scale**2 * size
        self.axes.scatter(*place, s=lines, marker=marker, color=colour, edgecolors=INK, linewidths=self.scale, zorder=3)
        ink = "white" if mcolors.rgb_to_hsv(mcolors.to_rgb(colour))[1] > 0.3 else INK
        words = {"ha": "center", "va": "center", "zorder": 4}
        self.axes.text(*place, name, fontsize=8.5 * self.scale, color=ink, weight="bold", **words)
        if count > 1:
            x, y = place
            self.axes.text(x + 0.42, y - 0.5, f"x {count}", fontsize=7.5 * self.scale, color=INK, **words)

    def arrow(
        self, start: Point, end: Point, colour: str, style: str = "-|>", bend: float = 0.0, width: float = 1.1,
        shrink: float = 15.0,
    ) -> None:  # fmt: skip
        """Draw an arrow to the rim of a node; ``bend`` is its sideways curvature as a fraction of its length."""
        self.axes.add_patch(
            FancyArrowPatch(
                start, end, arrowstyle=style, mutation_scale=11 * self.scale, color=colour,
                linewidth=width * self.scale, zorder=2, connectionstyle=f"arc3,rad={bend}",
                shrinkA=shrink * self.scale, shrinkB=15 * self.scale,
            )
        )  # fmt: skip

    def patch(self, corner: Point, size: Point, fill: str, rim: str, order: int) -> None:
        """Draw a box with round corners."""
        self.axes.add_patch(
            FancyBboxPatch(
                corner, *size, boxstyle="round,pad=0,rounding_size=0.3", facecolor=fill, edgecolor=rim,
                linewidth=self.scale, zorder=order,
            )
        )  # fmt: skip

    def text(self, corner: Point, words: str) -> None:
        """Write words below a corner."""
        behind = {"facecolor": "#f6f6f6", "edgecolor": "none", "pad": 1.0}
        self.axes.text(*corner, words, fontsize=9 * self.scale, va="top", color=INK, zorder=5, bbox=behind)
