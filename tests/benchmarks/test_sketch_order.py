"""The test of PPO against PPO+Sketch on larger grids gives the numbers worked by hand."""

import numpy as np
import pytest
from scipy.stats import mannwhitneyu

from benchmarks.committed import ROOT
from benchmarks.result_table import ResultTable
from benchmarks.sketch_order import PairsAhead, leads_by_chance, table


def test_pairs_ahead_of_two_seeds_by_hand():
    ahead = PairsAhead.of(np.array([0.5, 0.3]), np.array([0.4, 0.2]))
    assert ahead.cells() == ("3 of 4", "0.333"), "of six ways to share out, one gives 4 pairs and one gives 3"
    assert ahead.chances.tolist() == pytest.approx([1 / 6, 0, 1 / 6, 0, 2 / 6, 0, 1 / 6, 0, 1 / 6])


def test_ties_count_half_and_equal_values_give_p_1():
    assert PairsAhead.of(np.array([0.0, 0.5]), np.array([0.0, 0.0])).cells()[0] == "3 of 4"
    assert PairsAhead.of(np.zeros(3), np.zeros(3)).p_value == 1


def test_p_value_equals_scipy_without_ties():
    rng = np.random.default_rng(1)
    first, second = rng.random(5) + 0.3, rng.random(5)
    expected = mannwhitneyu(first, second, alternative="greater", method="exact")
    ahead = PairsAhead.of(first, second)
    assert (ahead.twice / 2, ahead.p_value) == (expected.statistic, pytest.approx(expected.pvalue))


def test_pairs_of_graphs_are_combined_as_independent():
    best = PairsAhead.of(np.array([2.0, 3.0]), np.array([0.0, 1.0]))
    assert best.p_value == pytest.approx(1 / 6)
    assert (best + best).cells() == ("8 of 8", f"{1 / 36:.3f}")


def test_leads_of_equal_methods_by_hand():
    values = np.array([0.0, 1.0])  # the difference of two binomial numbers of 5, by 5, is at least 0 and 1
    leads = leads_by_chance(values, np.random.default_rng(1))
    assert (leads >= 0).mean() == pytest.approx(638 / 1024, abs=0.01)
    assert (leads >= 1).mean() == pytest.approx(1 / 1024, abs=0.0005)


def test_sketch_order_table_equals_the_committed_one():
    assert table() == ResultTable.read(ROOT / "benchmarks" / "results" / "sketch_order.csv")
