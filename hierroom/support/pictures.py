"""Pictures side by side, matplotlib's settings for one thread at a time, and animations: a GIF or an MP4."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically

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


FORMATS = (".gif", ".mp4")
FRAMES_PER_SECOND = 10


def animate(frames: Iterable[NDArray[np.uint8]], path: str | Path) -> None:
    """Write pictures [H, W, 3] as a looping .gif or as an .mp4: ten a second, and the last one for a second.

    Smaller pictures are shown with white to the right and below.
    """
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
    """Return pictures [H, W, 3] as a looping GIF: see `animate`."""
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


def _mp4(pictures: Sequence[NDArray[np.uint8]]) -> bytes:
    """Return pictures as H.264, which browsers play. Sides are even numbers, as it halves colour resolution."""
    import av  # pyright: ignore[reportMissingImports]

    content = io.BytesIO()
    with av.open(content, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=FRAMES_PER_SECOND)
        filled = _of_one_size([*pictures, *[pictures[-1]] * (FRAMES_PER_SECOND - 1)], multiple=2)
        first = next(filled)
        stream.height, stream.width, stream.pix_fmt = *first.shape[:2], "yuv420p"
        for picture in chain([first], filled):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
    return content.getvalue()


def _of_one_size(pictures: Sequence[NDArray[np.uint8]], multiple: int = 1) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures with the sides of the largest, rounded up to a multiple; white fills the others."""
    heights, widths, _ = zip(*(picture.shape for picture in pictures), strict=True)
    height, width = (-(-max(sides) // multiple) * multiple for sides in (heights, widths))
    for picture in pictures:
        below, right = height - picture.shape[0], width - picture.shape[1]
        yield np.pad(picture, ((0, below), (0, right), (0, 0)), constant_values=255) if below or right else picture
