"""The trend of a method's lead with a measure, on ratios that are known."""

import numpy as np
import pytest

from benchmarks.study import interval_coverage, ratio_coverage
from benchmarks.study.bootstrap import Bootstrap
from benchmarks.study.paired import Paired
from benchmarks.study.trend import sentence, trends

RATIOS = np.array([0.5, 0.8, 1.0, 2.0, 3.0, 5.0, 9.0, np.inf])
MEASURES = {"exit_depth": np.arange(8.0), "width": np.array([8.0, 7, 6, 5, 4, 3, 2, 1]), "goals": np.arange(8.0)}


def found(n_seeds):
    second = np.full((8, n_seeds), 100.0)
    return Paired("steps_to_50", tuple("abcdefgh"), (RATIOS[:, None] * second, second), (np.ones(8), np.ones(8)))


def test_trends_correlate_ratio_with_depth_and_width():
    fitted = trends(found(3), MEASURES, Bootstrap(resamples=50))
    assert [*fitted] == ["exit_depth", "width"]
    assert fitted["exit_depth"].value == pytest.approx(1)
    assert fitted["width"].value == pytest.approx(-1)
    assert fitted["exit_depth"].low == pytest.approx(1), "seeds that are equal leave the order to the graphs"
    assert sentence(fitted) == (
        "Rank correlation of the ratio with exit_depth 1.00 [1.00, 1.00], width -1.00 [-1.00, -1.00]."
    )


def test_single_seed_has_no_interval():
    fitted = trends(found(1), MEASURES, Bootstrap(resamples=50))
    assert sentence(fitted) == "Rank correlation of the ratio with exit_depth 1.00, width -1.00."


def test_trends_without_their_measures_are_empty():
    assert trends(found(3), {"goals": np.arange(8.0)}, Bootstrap(resamples=2)) == {}
    assert sentence({}) == ""


def test_ratio_intervals_of_equal_methods_contain_1(capsys):
    ratio_coverage.main(ratio_coverage.Options(tables=5, resamples=40))
    rows = capsys.readouterr().out.splitlines()[2:]
    assert [row.split(" | ")[0] for row in rows] == [f"| {n}" for n in (1, 1, 4, 12, 12, 79, 79, 4, 4, 12, 12, 79)]
    assert all(float(row.split(" | ")[-1].rstrip(" |%")) >= 80 for row in rows if row.startswith(("| 12", "| 79")))


def test_correlation_intervals_contain_the_true_value(capsys):
    interval_coverage.main(interval_coverage.Options(tables=20, resamples=40))
    rows = [[*map(str.strip, row.strip("|").split("|"))] for row in capsys.readouterr().out.splitlines()[2:]]
    truths = [float(row[4]) for row in rows]
    assert truths[0] > truths[1] > truths[2] > truths[3]
    assert truths[5] < truths[2], "fewer seeds are noisier"
    assert all(float(row[column].rstrip("%")) >= 80 for row in rows for column in (5, 7))
