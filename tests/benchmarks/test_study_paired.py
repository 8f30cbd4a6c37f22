"""Two methods on the same goal graphs, on tables with known answers."""

import numpy as np
import pytest
from study_tables import measured_rows, run_rows

from benchmarks.study.bootstrap import Bootstrap
from benchmarks.study.paired import pair, ratios

GRAPHS = ("one", "two", "three", "four")
MEASURES = measured_rows(GRAPHS, twins=("one",), rooms=(2, 3, 4, 5))


def rows_of(**steps):
    return [
        {**row, "steps_to_50": row["steps_to_95"] or "40", "success_rate": "1" if row["steps_to_95"] else "0.25"}
        for method, of_graphs in steps.items()
        for row in run_rows(of_graphs, method)
    ]


def test_ratios_with_infinite_and_zero_steps():
    first = np.array([4.0, np.inf, 4, np.inf, 0, 0, 4])
    second = np.array([2.0, 2, np.inf, np.inf, 0, 4, 0])
    assert ratios(first, second).tolist() == [2, np.inf, 0, 1, 1, 0, np.inf]


def test_median_ratio_of_even_count_is_geometric_mean():
    steps = [110, 200, 450, 800]
    ppo = dict(zip(GRAPHS, ([n, n] for n in steps), strict=True))
    rows = rows_of(ppo=ppo, hippo={graph: [100, 100] for graph in GRAPHS})
    forth, back = (
        pair(rows, MEASURES, names).median_ratio(Bootstrap()) for names in (("ppo", "hippo"), ("hippo", "ppo"))
    )
    assert forth.value == pytest.approx(3.0)
    ends = forth.low, forth.high
    assert ends == pytest.approx((1.1, 8.0))  # of four graphs the interval is from the least to the greatest
    assert back == pytest.approx((1 / 3.0, 1 / 8.0, 1 / 1.1))
