"""How well the hitting time predicts what HiPPO learned: what the paper's Figure 5 shows, as rank correlations."""

from __future__ import annotations

from collections.abc import Sequence

from scipy.stats import permutation_test, spearmanr

from hierroom.lab.paper.cells import ComparedCell
from hierroom.lab.paper.published import PAPER_TABLE_2, PAPER_TABLE_3

FEWEST = 4
"""Fewer graphs can be ranked alike by chance."""
ALL = 10_000
"""More than there are orders of seven graphs, so that a test takes them all."""


def prediction(cells: Sequence[ComparedCell]) -> str:
    """One sentence with Spearman's correlations of the paper's hitting time over graphs.

    Each has the probability that an order drawn at random is correlated as strongly, exactly, by all orders.

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
        if len(set(values)) < 2:
            return "none (all are equal)"
        test = permutation_test(
            (values,), lambda shuffled: spearmanr(times, shuffled)[0], permutation_type="pairings", n_resamples=ALL
        )
        return f"{test.statistic:.2f} (p = {test.pvalue:.2f})"

    told = [
        f"with {quantity} ours {correlation([getattr(cell, quantity) for cell in own])}, "
        f"the paper's {correlation([getattr(PAPER_TABLE_3['hippo', cell.graph], quantity) for cell in own])}"
        for quantity in ("success", "length")
    ]
    told.append(f"with our training steps until 95% {correlation([cell.steps_to_95 for cell in own])}")
    over = f"over {len(own)} graphs (p by an exact permutation test)"
    return f"Rank correlation of the paper's hitting time {over}, HiPPO: {'; '.join(told)}."
