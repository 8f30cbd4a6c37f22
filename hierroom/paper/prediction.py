"""How well the hitting time predicts what HiPPO learned: what the paper's Figure 5 shows, as rank correlations."""

from __future__ import annotations

from collections.abc import Sequence

from scipy.stats import spearmanr

from hierroom.paper.cells import ComparedCell
from hierroom.paper.published import PAPER_TABLE_2, PAPER_TABLE_3

FEWEST = 4
"""Fewer graphs can be ranked alike by chance."""


def prediction(cells: Sequence[ComparedCell]) -> str:
    """One sentence with Spearman's correlations of the paper's hitting time over graphs.

    Args:
        cells: of one grid size; those of HiPPO count.

    Returns:
        the sentence; nothing of fewer than four graphs.
    """
    own = [cell for cell in cells if cell.method == "hippo"]
    if len(own) < FEWEST:
        return ""
    times = [PAPER_TABLE_2[cell.graph].hitting_time for cell in own]

    def correlation(values: Sequence[float]) -> str:
        return f"{spearmanr(times, values)[0]:.2f}" if len(set(values)) > 1 else "none (all are equal)"

    told = [
        f"with {quantity} ours {correlation([getattr(cell, quantity) for cell in own])}, "
        f"the paper's {correlation([getattr(PAPER_TABLE_3['hippo', cell.graph], quantity) for cell in own])}"
        for quantity in ("success", "length")
    ]
    told.append(f"with our training steps until 95% {correlation([cell.steps_to_95 for cell in own])}")
    return f"Rank correlation of the paper's hitting time over {len(own)} graphs, HiPPO: {'; '.join(told)}."
