"""How well the hitting time predicts what HiPPO learned: the paper's Figure 5 as rank correlations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from scipy.stats import permutation_test, spearmanr

from hierroom.lab.paper.published import PAPER_TABLE_2, PAPER_TABLE_3

if TYPE_CHECKING:
    import pandas as pd

FEWEST = 4  # graphs; fewer can be ranked alike by chance
ALL = 10_000  # more than there are orders of seven graphs, so that a test takes them all


def prediction(cells: pd.DataFrame) -> str:
    """Return a sentence with Spearman's correlations of the paper's hitting time with HiPPO's cells of one grid size.

    It is empty for fewer than four graphs. Each correlation has its exact p-value, by all orders of the graphs.
    """
    own = cells[cells["method"] == "hippo"]
    if len(own) < FEWEST:
        return ""
    times = [PAPER_TABLE_2[graph].hitting_time for graph in own["graph"]]

    def correlation(values: Sequence[float]) -> str:
        if len(set(values)) < 2:
            return "none (all are equal)"
        test = permutation_test(
            (values,), lambda shuffled: spearmanr(times, shuffled)[0], permutation_type="pairings", n_resamples=ALL
        )
        return f"{test.statistic:.2f} (p = {test.pvalue:.2f})"

    parts = [
        f"with {quantity} ours {correlation([*own[quantity]])}, "
        f"the paper's {correlation([getattr(PAPER_TABLE_3['hippo', graph], quantity) for graph in own['graph']])}"
        for quantity in ("success", "length")
    ]
    parts.append(f"with our training steps until 95% {correlation([*own['steps_to_95']])}")
    over = f"over {len(own)} graphs (p by an exact permutation test)"
    return f"Rank correlation of the paper's hitting time {over}, HiPPO: {'; '.join(parts)}."
