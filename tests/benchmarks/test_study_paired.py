"""Two methods on the same goal graphs, on tables with known answers."""

import numpy as np
import pytest
from study_tables import measured_rows, run_rows

from benchmarks.study.bootstrap import Bootstrap
from benchmarks.study.paired import Paired, median_ratios, pair, ratios
from hierroom.support.errors import InputError

GRAPHS = ("one", "two", "three", "four")
MEASURES = measured_rows(GRAPHS, twins=("one",), rooms=(2, 3, 4, 5))


def rows_of(**steps):
    return [
        {**row, "steps_to_50": row["steps_to_95"] or "40", "success_rate": "1" if row["steps_to_95"] else "0.25"}
        for method, of_graphs in steps.items()
        for row in run_rows(of_graphs, method)
    ]


def everywhere(steps):
    return {graph: [steps] for graph in GRAPHS}


def test_ratios_with_infinite_and_zero_steps():
    first = np.array([4.0, np.inf, 4, np.inf, 0, 0, 4])
    second = np.array([2.0, 2, np.inf, np.inf, 0, 4, 0])
    assert ratios(first, second).tolist() == [2, np.inf, 0, 1, 1, 0, np.inf]


def test_pair_compares_common_graphs_without_twins():
    rows = rows_of(
        ppo={"one": [100], "two": [200], "one-twin": [1]}, hippo={"one": [50], "three": [70], "one-twin": [100]}
    )
    both = pair(rows, MEASURES, ("ppo", "hippo"))
    assert both.graphs == ("one",)
    assert both.ratios.tolist() == [2.0]
    with pytest.raises(InputError, match="no goal graph has runs of both ppo and hippo"):
        pair(rows_of(ppo={"one": [100]}, hippo={"two": [50]}), MEASURES, ("ppo", "hippo"))


def test_pair_uses_the_lower_milestone_of_both():
    rows = rows_of(one=everywhere(100), other=everywhere(100), hopeless=everywhere(None))
    assert pair(rows, MEASURES, ("one", "other")).outcome == "steps_to_95"
    assert pair(rows, MEASURES, ("one", "hopeless")).outcome == "steps_to_50"
    assert pair(rows, MEASURES, ("hopeless", "one")).outcome == "steps_to_50"


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


def test_median_ratio_of_inverse_ratios_is_inverse():
    inf = np.inf
    rows = np.array([[0, 1, 4, inf], [0, 0, inf, inf], [0, 0, 2, inf], [1, 2, inf, inf], [0, 0, 0, 2], [5, 5, 6, 6]])
    expected = [2, 1, 0, inf, 0, np.sqrt(30)]
    assert median_ratios(rows) == pytest.approx(expected)
    with np.errstate(divide="ignore"):
        assert median_ratios(1 / rows) == pytest.approx(1 / np.array(expected))


def test_resampled_copies_of_a_graph_draw_own_seeds():
    both = pair(rows_of(ppo={"one": [1, 100]}, hippo={"one": [1, 1]}), MEASURES, ("ppo", "hippo"))
    drawn = both._resampled(np.random.default_rng(0), np.zeros(50, int))
    assert set(drawn) == {1, 50.5, 100}


def test_pair_notices_a_single_seed():
    both = pair(rows_of(ppo={"one": [100, 110]}, hippo={"one": [50]}), MEASURES, ("ppo", "hippo"))
    assert both.has_single_seed.tolist() == [True]


@pytest.mark.parametrize("n_graphs", [1, 2, 3, 4, 5, 6])
def test_single_seed_needs_enough_graphs_for_an_interval(n_graphs):
    names = tuple(map(str, range(n_graphs)))
    first, second = np.full((n_graphs, 1), 200.0), np.full((n_graphs, 1), 100.0)
    both = Paired("steps_to_95", names, (first, second), (np.ones(n_graphs), np.ones(n_graphs)))
    share = 1 - 2 * 0.5**n_graphs  # of cases in which the least and the greatest of independent ratios hold the median
    for level in (0.4, 0.8, 0.95, 0.99):
        found = both.median_ratio(Bootstrap(resamples=20, level=level))
        assert found.value == 2
        assert np.isnan(found.low) == np.isnan(found.high) == (share < level)
