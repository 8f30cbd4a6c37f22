"""Pictures side by side, and pictures drawn by matplotlib with settings that belong to the process."""

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
    """Return pictures [H, W, 3] as one, white below those that are not as high as the highest."""
    height = max(map(len, pictures))
    below = [np.full((height - len(one), one.shape[1], 3), 255, np.uint8) for one in pictures]
    return np.concatenate([np.concatenate(pair) for pair in zip(pictures, below, strict=True)], axis=1)


@contextmanager
def drawing(style: dict[Any, Any] | None = None) -> Iterator[None]:
    """Draw in a style, one thread at a time: matplotlib's settings and the filters of warnings are the process's."""
    import matplotlib  # imported here, because it loads slowly

    with _one_draws, matplotlib.rc_context(style), warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"Glyph \d+")  # of a name in a script that the font does not have
        yield
