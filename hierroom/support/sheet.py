"""A sheet with graphs side by side: texts in boxes, arrows between them, a title above each graph, and notes below."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import rgb_to_hsv, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch
from matplotlib.path import Path as Line

from hierroom.support.errors import InputError
from hierroom.support.files import usable_path, write_atomically
from hierroom.support.layers import Edge, Point, place_layers
from hierroom.support.pictures import drawing

PICTURE_FORMATS = (".png", ".pdf", ".svg")
MARGIN, SIZE, PAD, LONGEST = 18.0, 9.0, 5.0, 24
"""In points: around a sheet, height of letters, around the text in a box; and the most letters in a line of a box."""
ADVANCE, LINE = 0.64, 1.25
"""Width of every letter of the font, rounded up to pixels, and height of a line, for letters of height 1."""
INK, FAINT, PALE, EXIT_COLOUR, USED_COLOUR = "#333333", "#9a9a9a", "#e8eef9", "#35a853", "#e15759"
ROOM_COLOURS = ("#d9d9d9", "#4c8bf5", "#b565d8", "#f28e2b", "#e15759", "#17a2b8", "#c9a400", "#8c6d5a", "#7a8b99")


def colour_of(room: int) -> str:
    """Return the colour of the start or a room; a key has the colour of the room it opens."""
    return ROOM_COLOURS[room and 1 + (room - 1) % (len(ROOM_COLOURS) - 1)]


class Sheet:
    """A figure of graphs; lengths are in points, from the upper left corner of the last graph begun."""

    def __init__(self) -> None:
        self.figure = Figure()
        self._axes = self.figure.add_axes((0, 0, 1, 1))
        self._axes.axis("off")
        self._corner, self._right, self._bottom = (0.0, 0.0), 0.0, 0.0

    def begin(self, title: str, size: Point) -> None:
        """Begin a graph of a size, to the right of the others."""
        width, height = _size_of(title, SIZE + 1)
        whole, left = max(width, size[0]), self._right + (2 * MARGIN if self._right else MARGIN)
        self._corner = left, MARGIN
        self.write((whole / 2, 0), title, SIZE + 1, ha="center")
        self._corner = left + (whole - size[0]) / 2, height + 2 * MARGIN
        self._right, self._bottom = left + whole, max(self._bottom, self._corner[1] + size[1])

    def boxes(
        self, title: str, names: Sequence[str], layers: Sequence[float], colours: Sequence[str],
        edges: Mapping[Edge, str], rims: Sequence[str] = (),
    ) -> None:  # fmt: skip
        """Draw a graph of names in boxes, in layers.

        ``edges`` have colours. Two arrows of one colour, there and back, are drawn as one.
        """
        texts = ["\n".join(textwrap.fill(line, LONGEST) for line in name.split("\n")) for name in names]
        sizes = [(width + 2 * PAD, height + 2 * PAD) for width, height in map(_size_of, texts)]
        widest, narrowest = max(sizes)[0], min(sizes)[0]
        if widest < 1.5 * narrowest:
            sizes = [(widest, height) for _, height in sizes]  # in line with each other
        places, routes, size = place_layers(sizes, layers, [one for i, j in edges for one in ((i, j), (j, i))])
        self.begin(title, size)
        for (i, j), colour in edges.items():
            is_both = edges.get((j, i)) == colour
            if i < j or not is_both:
                route = routes[i, j] if (i, j) in routes else routes[j, i][::-1]
                self.arrow(route, colour, "<|-|>" if is_both else "-|>")
        for n, (place, text) in enumerate(zip(places, texts, strict=True)):
            self.box(place, sizes[n], text, colours[n], rims[n] if rims else INK)

    def box(self, centre: Point, size: Point, text: str, colour: str, rim: str = INK, **style: Any) -> None:
        """Draw a box with a text in its middle; matplotlib's ``style`` may change its shape and order."""
        x, y = self._on_sheet((centre[0] - size[0] / 2, centre[1] - size[1] / 2))
        style = {"boxstyle": "round,pad=0,rounding_size=5", "zorder": 3, **style}
        self._axes.add_artist(FancyBboxPatch((x, y), *size, facecolor=colour, edgecolor=rim, **style))
        ink = "white" if rgb_to_hsv(to_rgb(colour))[1] > 0.3 else INK
        self.write(centre, text, ha="center", va="center", color=ink)

    def arrow(self, points: Sequence[Point], colour: str = INK, heads: str = "-|>", width: float = 1.1) -> None:
        """Draw an arrow along pairs of points: straight within a pair, and in a curve from pair to pair."""
        path = np.array([self._on_sheet(point) for point in points])
        ways = path[1::2] - path[::2]
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        vertices, codes = [*path[:2]], [Line.MOVETO, Line.LINETO]
        for n in range(1, len(ways)):
            start, end = path[2 * n - 1], path[2 * n]
            bend = max(abs((end - start) @ ways[n - 1]) / 2, SIZE)
            vertices += [start + bend * ways[n - 1], end - bend * ways[n], end, path[2 * n + 1]]
            codes += [*[Line.CURVE4] * 3, Line.LINETO]
        style = {"arrowstyle": heads, "mutation_scale": 9, "color": colour, "linewidth": width, "zorder": 2}
        self._axes.add_artist(FancyArrowPatch(path=Line(vertices, codes), **style))

    def write(self, at: Point, text: str, size: float = SIZE, **style: Any) -> None:
        """Write a text below a point, or where matplotlib's ``style`` says."""
        style = {"va": "top", "color": INK, "zorder": 4, "family": "monospace", "linespacing": LINE, **style}
        self._axes.text(*self._on_sheet(at), text, fontsize=size, parse_math=False, **style)

    def finish(self, notes: Sequence[str]) -> Figure:
        """Write notes below the graphs, and return the figure, as large as all of it."""
        self._corner = 0.0, 0.0
        width, height = _size_of("\n".join(notes), SIZE - 1)
        self.write((MARGIN, self._bottom + MARGIN), "\n".join(notes), SIZE - 1)
        right, bottom = max(self._right, MARGIN + width) + MARGIN, self._bottom + height + 2 * MARGIN
        self._axes.set(xlim=(0, right), ylim=(bottom, 0))
        self.figure.set_size_inches(right / 72, bottom / 72)
        return self.figure

    def _on_sheet(self, point: Point) -> Point:
        return self._corner[0] + point[0], self._corner[1] + point[1]


def _size_of(text: str, size: float = SIZE) -> Point:
    lines = text.split("\n")
    return ADVANCE * size * max(map(len, lines)), LINE * size * len(lines)


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


def picture_of(figure: Figure, form: str) -> bytes:
    """Return the content of a picture file: png, pdf or svg."""
    picture = io.BytesIO()
    with drawing():
        figure.savefig(picture, format=form, dpi=150, facecolor="white")
    return picture.getvalue()


def save_figure(figure: Figure, path: str | Path) -> None:
    """Write a figure atomically to a .png (the default), .pdf or .svg file."""
    path = picture_file(path)
    write_atomically(path, picture_of(figure, path.suffix[1:].lower()))
