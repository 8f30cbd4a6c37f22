"""Writing a sequence of pictures as an animated GIF."""

from __future__ import annotations

import io
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hierroom.errors import InputError
from hierroom.files import write_atomically


def animate(frames: Iterable[NDArray[np.uint8]], path: str | Path, seconds_per_frame: float = 0.1) -> None:
    """Write pictures of equal size as an animated GIF that loops for ever; the last one is shown for a second.

    Args:
        frames: [H, W, 3] uint8 each, at least one.
        path: the file; its folder must exist.
        seconds_per_frame: duration of each other picture, which the format stores in units of 0.01.

    Raises:
        InputError: if there is no frame or the file cannot be written.
    """
    images = [Image.fromarray(frame).quantize(128) for frame in frames]
    if not images:
        raise InputError(f"an animation needs at least one picture, but there is none for {path}")
    milliseconds = [round(1000 * seconds_per_frame)] * (len(images) - 1) + [1000]
    content = io.BytesIO()
    images[0].save(content, format="GIF", save_all=True, append_images=images[1:], duration=milliseconds, loop=0)
    write_atomically(path, content.getvalue())
