"""Pictures side by side, and thread-safe drawing by matplotlib, which has settings for the whole process."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
