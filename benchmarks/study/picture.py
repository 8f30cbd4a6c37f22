"""A picture of trained agents: written in the style of figures for papers, a PNG with a digest of what it shows."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable, Iterator
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator
from numpy.typing import ArrayLike

from hierroom.lab.compare.style import STYLE
from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically

ENTRY = "Points"
"""Of the PNG's text that holds the digest."""


def write(make: Callable[[], Figure], path: Path) -> None:
    """Make a figure in the style of figures for papers, write it, into a new folder if need be, and say so.

    Args:
        make: makes the figure.
        path: the picture; its suffix chooses the format, by default PNG.

    Raises:
        InputError: as `make` does, or if it cannot be written, or not in the format of this ending.
    """
    path = path if path.suffix else path.with_suffix(".png")
    picture, suffix = io.BytesIO(), path.suffix[1:].lower()
    with matplotlib.rc_context(STYLE):
        figure = make()
        try:
            metadata = {ENTRY: digest(figure)} if suffix == "png" else None
            figure.savefig(picture, format=suffix, dpi=150, metadata=metadata)
            path.parent.mkdir(parents=True, exist_ok=True)
        except (OSError, ValueError) as error:
            raise InputError(f"cannot draw to {path}: {error}") from error
    write_atomically(path, picture.getvalue())
    print(f"drawn: {path}")


def digest(figure: Figure) -> str:
    """Of its texts and colours, and of its points to four digits."""
    hasher = hashlib.sha256()
    for legend in figure.legends:
        hasher.update(repr([text.get_text() for text in legend.get_texts()]).encode())
    for axes in figure.axes:
        hasher.update(repr([axes.get_xlabel(), axes.get_ylabel(), axes.get_title()]).encode())
        hasher.update(repr([text.get_text() for text in axes.texts]).encode())
        if isinstance(axes.yaxis.get_major_locator(), FixedLocator):  # names, not numbers that matplotlib chose
            hasher.update(repr([label.get_text() for label in axes.get_yticklabels()]).encode())
        for colour, points in _marks(axes):
            hasher.update(colour.encode())
            hasher.update(" ".join(f"{number:.4g}" for number in np.asarray(points, dtype=float).ravel()).encode())
    return hasher.hexdigest()


def _marks(axes: Axes) -> Iterator[tuple[str, ArrayLike]]:
    """Its lines, marks and bands, the colour and the points of each."""
    for line in axes.lines:
        yield to_hex(line.get_color()), line.get_xydata()
    for collection in axes.collections:
        colour = " ".join(map(to_hex, np.concatenate([collection.get_facecolor(), collection.get_edgecolor()])))
        if isinstance(collection, LineCollection):
            points = collection.get_segments()
        elif isinstance(collection, PolyCollection):
            points = [path.vertices for path in collection.get_paths()]
        else:
            points = [np.ma.getdata(collection.get_offsets())]
        yield from ((colour, one) for one in points)
