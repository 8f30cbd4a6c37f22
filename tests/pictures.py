"""Reading back the pictures that were written."""

from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageSequence

MILLISECONDS = 100
"""Milliseconds for which `gif` shows a picture."""


def pixels(path: Path) -> NDArray[np.int64]:
    """Return the colours of a PNG [H, W, 3], which are not all one."""
    with Image.open(path) as image:
        assert image.format == "PNG"
        colours = np.asarray(image.convert("RGB")).astype(int)
    assert (colours != colours[0, 0]).any()
    return colours


def has_colour(colours: NDArray[np.int64], name: str, tolerance: int = 8) -> NDArray[np.bool_]:
    """Return flags [H, W] of pixels with a colour that matplotlib knows."""
    from matplotlib.colors import to_rgb

    return abs(colours - np.round(255 * np.array(to_rgb(name)))).max(axis=2) <= tolerance


def frames(path: Path) -> list[NDArray[np.int64]]:
    """The pictures [H, W, 3] of a GIF that `gif` made.

    The file holds those that equal the one before only as a longer duration, and the last one is shown for a second.
    """
    with Image.open(path) as image:
        assert image.format == "GIF"
        assert image.info["loop"] == 0
        stored = [
            (np.asarray(frame.convert("RGB")).astype(int), int(frame.info["duration"]))
            for frame in ImageSequence.Iterator(image)
        ]
    for (one, _), (following, _) in pairwise(stored):
        assert one.shape == following.shape
        assert (one != following).any()
    shown = []
    for n, (frame, duration) in enumerate(stored, start=1):
        times, rest = divmod(duration - 1000 if n == len(stored) else duration, MILLISECONDS)
        assert rest == 0
        shown += [frame] * (times + (n == len(stored)))
    return shown
