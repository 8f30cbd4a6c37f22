"""The style and the files of figures for papers."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from hierroom.support.files import write_atomically

# Okabe & Ito's palette for the colour-blind, without its yellow, which is faint on white.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
DASHES = ("-", "--", ":", "-.")
MAX_GROUPS = len(COLOURS) * len(DASHES)

STYLE: dict[Any, Any] = {
    "pdf.fonttype": 42,  # TrueType: editors and publishers refuse type 3
    "font.size": 8,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.frameon": False,
}


def line_style(number: int) -> tuple[str, int]:
    """Return the colour of a line by its number from 0, and its index in `DASHES`; neighbours differ in both."""
    cycle, colour = divmod(number, len(COLOURS))
    return COLOURS[colour], (colour + cycle) % len(DASHES)


def save(figure: Figure, path: Path, dpi: int) -> list[Path]:
    """Write a figure as PDF and PNG, with the same bytes every time; return the files."""
    paths = []
    for suffix, metadata in (("pdf", {"CreationDate": None}), ("png", None)):
        picture = io.BytesIO()
        figure.savefig(picture, format=suffix, dpi=dpi, metadata=metadata)
        paths.append(path.with_suffix(f".{suffix}"))
        write_atomically(paths[-1], picture.getvalue())
    return paths
