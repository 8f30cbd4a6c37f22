"""Pictures drawn by matplotlib, whose settings belong to the process."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

_one_draws = Lock()


@contextmanager
def drawing(style: dict[Any, Any] | None = None) -> Iterator[None]:
    """Draw in a style, one thread at a time: matplotlib's settings and the filters of warnings are the process's."""
    import matplotlib  # imported here, because it loads slowly

    with _one_draws, matplotlib.rc_context(style), warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"Glyph \d+")  # of a name in a script that the font does not have
        yield
