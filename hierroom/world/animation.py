"""Pictures one after another, as a file."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hierroom.errors import InputError


def animate(frames: Iterable[NDArray[np.uint8]], path: str | Path, seconds_per_frame: float = 0.1) -> None:
    """Write pictures of one size as an animated GIF that repeats for ever; the last one stays for a second.

    The file appears whole or not at all.

    Args:
        frames: [H, W, 3] uint8 each, at least one.
        path: where to; its folder must exist.
        seconds_per_frame: in steps of 0.01.

    Raises:
        InputError: if there is no frame or the file cannot be written.
    """
    images = [Image.fromarray(frame).quantize(128) for frame in frames]
    if not images:
        raise InputError(f"an animation needs at least one picture, and {path} was given none")
    milliseconds = [round(1000 * seconds_per_frame)] * (len(images) - 1) + [1000]
    unfinished = Path(f"{path}.part")
    try:
        images[0].save(unfinished, format="GIF", save_all=True, append_images=images[1:], duration=milliseconds, loop=0)
        os.replace(unfinished, path)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise InputError(f"cannot write the animation {path}: {error.strerror}") from error
