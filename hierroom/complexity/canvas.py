"""Drawing primitives for graphs: colours, circles, squares and arrows."""

from __future__ import annotations

from collections.abc import Iterable

import matplotlib.colors as mcolors
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch

ROOM_COLOURS = ("#d9d9d9", "#4c8bf5", "#b565d8", "#f28e2b", "#e15759", "#17a2b8", "#c9a400", "#8c6d5a", "#7a8b99")
"""Colours of the start and of rooms 1, 2, ...; a key has the colour of the room it opens."""
EXIT_COLOUR = "#35a853"
INK, FAINT = "#333333", "#9a9a9a"

Point = tuple[float, float]
"""(x, y) in units of the drawing."""


def extent(places: Iterable[Point]) -> Point:
    """Width and height of a drawing, including a margin around the outermost nodes."""
    (left, right), (bottom, top) = _limits(places)
    return right - left, top - bottom


def _limits(places: Iterable[Point]) -> tuple[Point, Point]:
    xs, ys = zip(*places, strict=True)
    middle, half = (min(xs) + max(xs)) / 2, max((max(xs) - min(xs)) / 2 + 1.2, 2.4)  # 2.4: the title fits
    return (middle - half, middle + half), (min(ys) - 1.2, max(ys) + 1.5)


def prepare(axes: Axes, title: str, places: Iterable[Point]) -> None:
    """Set the title and the limits of a drawing, with the same scale in both directions."""
    axes.set_title(title, fontsize=11, color=INK)
    axes.set_aspect("equal", anchor="N")
    horizontal, vertical = _limits(places)
    axes.set_xlim(*horizontal)
    axes.set_ylim(*vertical)
    axes.axis("off")


def colour_of(room: int) -> str:
    """The colour of a room and of the key that opens it; after the ninth the room colours repeat."""
    return ROOM_COLOURS[room] if room < len(ROOM_COLOURS) else ROOM_COLOURS[1 + (room - 1) % (len(ROOM_COLOURS) - 1)]


def circle(axes: Axes, place: Point, colour: str, text: str) -> None:
    """Draw a room, a door or the exit."""
    _node(axes, place, colour, text, "o", 760)


def square(axes: Axes, place: Point, colour: str, text: str) -> None:
    """Draw a key."""
    _node(axes, place, colour, text, "s", 620)


def _node(axes: Axes, place: Point, colour: str, text: str, marker: str, size: float) -> None:
    axes.scatter(*place, s=size, marker=marker, color=colour, edgecolors=INK, linewidths=1.0, zorder=3)
    ink = "white" if mcolors.rgb_to_hsv(mcolors.to_rgb(colour))[1] > 0.3 else INK
    axes.text(*place, text, fontsize=8.5, ha="center", va="center", color=ink, weight="bold", zorder=4)


def arrow(
    axes: Axes, start: Point, end: Point, colour: str, style: str = "-|>", bend: float = 0.0, width: float = 1.1
) -> None:
    """Draw an arrow between the rims of two nodes; ``bend`` is its sideways curvature as a fraction of its length."""
    axes.add_patch(
        FancyArrowPatch(
            start, end, arrowstyle=style, mutation_scale=11, color=colour, linewidth=width, zorder=2,
            connectionstyle=f"arc3,rad={bend}", shrinkA=15, shrinkB=15,
        )
    )  # fmt: skip
