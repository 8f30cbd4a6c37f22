"""Pictures side by side, matplotlib's settings for one thread at a time, and animations."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

_one_draws = Lock()


def side_by_side(*pictures: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return pictures [H, W, 3] side by side as one picture, with white below those that are less high."""
    height = max(map(len, pictures))
    below = [np.full((height - len(one), one.shape[1], 3), 255, np.uint8) for one in pictures]
    return np.concatenate([np.concatenate(pair) for pair in zip(pictures, below, strict=True)], axis=1)


def legend_text(name: str) -> str:
    """Return a name as a label; matplotlib leaves labels that begin with an underscore out of legends."""
    return f" {name}" if name.startswith("_") else name


@contextmanager
def drawing(style: dict[Any, Any] | None = None) -> Iterator[None]:
    """Draw in a style, one thread at a time, as matplotlib's settings and warning filters are those of the process."""
    import matplotlib  # imported here, because it loads slowly

    with _one_draws, matplotlib.rc_context(style), warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"Glyph \d+")  # names may have glyphs that the font lacks
        yield


FRAMES_PER_SECOND = 10


def gif(frames: Iterable[NDArray[np.uint8]]) -> bytes:
    """Return pictures [H, W, 3], at least one, as a looping GIF: ten a second, and the last one for a second.

    Smaller pictures are shown with white to the right and below.
    """
    pictures = list(frames)
    is_used = np.zeros(2**24, bool)  # by colour
    for picture in _of_one_size(pictures):
        is_used[picture.astype(np.int32) @ (2**16, 2**8, 1)] = True
    colours = np.flatnonzero(is_used)[None, :, None] >> (16, 8, 0) & 255
    # All pictures share one palette: a palette for each would take several times as long and make the file larger.
    palette = Image.fromarray(colours.astype(np.uint8)).quantize(256)
    # One after the other: pictures of a task with many goals, held in several forms at once, take gigabytes.
    images = map(Image.fromarray, _of_one_size(pictures))
    quantized = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    milliseconds = [1000 // FRAMES_PER_SECOND] * (len(pictures) - 1) + [1000]
    content = io.BytesIO()
    next(quantized).save(content, format="GIF", save_all=True, append_images=quantized, duration=milliseconds, loop=0)
    return content.getvalue()


def _of_one_size(pictures: Sequence[NDArray[np.uint8]]) -> Iterator[NDArray[np.uint8]]:
    height, width = (max(sides) for sides in zip(*(picture.shape[:2] for picture in pictures), strict=True))
    for picture in pictures:
        below, right = height - picture.shape[0], width - picture.shape[1]
        yield np.pad(picture, ((0, below), (0, right), (0, 0)), constant_values=255) if below or right else picture
