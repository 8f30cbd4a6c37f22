"""Write a sequence of pictures as an animation: a GIF or an MP4."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically

FORMATS = (".gif", ".mp4")
FRAMES_PER_SECOND = 10


def animate(frames: Iterable[NDArray[np.uint8]], path: str | Path) -> None:
    """Write pictures [H, W, 3] as a looping .gif or as an .mp4: ten a second, and the last one for a second."""
    kind = Path(path).suffix.lower()
    if kind not in FORMATS:
        raise InputError(f"an animation is a {' or '.join(FORMATS)} file, not {path}")
    require_format(path)
    pictures = list(frames)
    if not pictures:
        raise InputError(f"an animation needs at least one picture, but there is none for {path}")
    write_atomically(path, (gif if kind == ".gif" else _mp4)(pictures))


def require_format(path: str | Path) -> None:
    """Check that PyAV is installed if the file is an MP4; call it before long work on the pictures."""
    if Path(path).suffix.lower() == ".mp4":
        try:
            import av  # noqa: F401  # pyright: ignore[reportMissingImports]
        except ImportError:
            raise InputError(f"writing {path} needs PyAV, which `pip install av` installs; a .gif needs none") from None


def gif(pictures: Sequence[NDArray[np.uint8]]) -> bytes:
    """Return pictures [H, W, 3] as a looping GIF: ten a second, and the last one for a second."""
    n_pixels = max(picture.shape[0] * picture.shape[1] for picture in pictures)
    counted = (Image.fromarray(picture).getcolors(n_pixels) for picture in pictures)
    colours = {colour for counts in counted for _, colour in counts or ()}
    # All pictures share one palette: a palette for each would take several times as long and make the file larger.
    palette = Image.fromarray(np.array([sorted(colours)], np.uint8)).quantize(256)
    # One after the other: pictures of a task with many goals, held in several forms at once, take gigabytes.
    images = (Image.fromarray(one).quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures)
    milliseconds = [1000 // FRAMES_PER_SECOND] * (len(pictures) - 1) + [1000]
    content = io.BytesIO()
    next(images).save(content, format="GIF", save_all=True, append_images=images, duration=milliseconds, loop=0)
    return content.getvalue()


def _mp4(pictures: Sequence[NDArray[np.uint8]]) -> bytes:
    """Return pictures as H.264, which browsers play. Pad sides to even numbers, as it halves colour resolution."""
    import av  # pyright: ignore[reportMissingImports]

    content = io.BytesIO()
    height, width = (side + side % 2 for side in pictures[0].shape[:2])
    with av.open(content, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=FRAMES_PER_SECOND)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        for picture in [*pictures, *[pictures[-1]] * (FRAMES_PER_SECOND - 1)]:
            filled = np.pad(picture, ((0, height - picture.shape[0]), (0, width - picture.shape[1]), (0, 0)))
            container.mux(stream.encode(av.VideoFrame.from_ndarray(filled, format="rgb24")))
        container.mux(stream.encode())
    return content.getvalue()
