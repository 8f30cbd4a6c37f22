"""The comparison on tasks of others."""

import numpy as np
import pandas as pd
import pytest

from benchmarks.others import interval


def test_interval_of_a_ratio_is_over_seeds_and_a_failed_run_counts_all_its_steps():
    rows = pd.DataFrame(
        [("hierroom", 30.0), ("hierroom", np.nan), ("ppo", 20.0), ("ppo", 20.0), ("recurrent-ppo", np.nan)],
        columns=["method", "reached"],
    ).assign(steps=60)
    assert interval(rows) == pytest.approx((1.5, 3.0))  # from both seeds 30 to both 60, over the better one's 20
    assert interval(rows[rows.method != "ppo"]) == pytest.approx((0.5, 1.0))
