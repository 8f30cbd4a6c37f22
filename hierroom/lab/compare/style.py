"""How figures for papers look."""

from __future__ import annotations

from typing import Any

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Okabe & Ito's palette, told apart by the colour-blind, without its yellow, which is faint on white."""
DASHES = ("-", "--", ":", "-.")
"""How lines are told apart that lie on each other, and those of one colour."""

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
"""Settings of matplotlib for figures in papers."""


def line_style(number: int) -> tuple[str, int]:
    """The colour of a line, and which of `DASHES` it has.

    Args:
        number: of the line, from 0; below ``len(COLOURS) * len(DASHES)`` no two look the same, nor do neighbours share
            either.
    """
    cycle, colour = divmod(number, len(COLOURS))
    return COLOURS[colour], (colour + cycle) % len(DASHES)
