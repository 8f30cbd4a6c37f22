"""The correlations on the pages, and the number of seeds behind each."""

from pathlib import Path

import pytest

from benchmarks import committed, page_statistics
from benchmarks.study.tables import read_rows
from hierroom.support.errors import InputError

ROOT = Path(__file__).parents[2]


def test_committed_correlations_are_those_on_pages():
    shown = page_statistics.shown_correlations()
    assert len(shown) == len(set(shown))
    paths = {ROOT / "benchmarks" / "results" / name / page_statistics.correlations_file(one) for name, one in shown}
    assert paths == {*(ROOT / "benchmarks" / "results").glob("*/correlations*.csv")}


@pytest.mark.parametrize("name", sorted({name for name, _ in page_statistics.shown_correlations()}))
def test_correlations_use_all_whole_seeds(name):
    (row, *_) = read_rows(ROOT / "benchmarks" / "results" / name / "correlations.csv")
    assert int(row["seeds_min"]) == int(row["seeds_max"]) == page_statistics.n_whole_seeds(name)


def test_a_seed_is_whole_when_all_its_runs_are_done(monkeypatch):
    missing = []
    rows_of = committed.SweepTable.of
    monkeypatch.setattr(
        page_statistics.SweepTable, "of", lambda self, runs: (rows := rows_of(self, runs))[~rows["seed"].isin(missing)]
    )
    assert page_statistics.n_whole_seeds("hippo") == 5
    missing.append("3")
    assert page_statistics.n_whole_seeds("hippo") == 3
    missing.append("0")
    assert page_statistics.n_whole_seeds("hippo") == 0
    with pytest.raises(InputError, match="the table has no row of a seed below 0"):
        page_statistics.write_correlations("hippo", None)
