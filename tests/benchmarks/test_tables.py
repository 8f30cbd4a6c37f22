"""The tables of sweeps in README and docs equal those of their committed rows."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks import tables
from benchmarks.study.correlations import correlations
from benchmarks.study.tables import first_seeds, measures_for, read_rows
from benchmarks.study.trained import by_rule, measures_of, medians, read_trained

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
@pytest.mark.parametrize("page", tables.PAGES, ids=lambda page: page.name)
def test_tables_on_pages_equal_their_rows(page, monkeypatch):
    monkeypatch.chdir(ROOT)
    for path, text in {page: tables.renewed(page.read_text()), **tables.files_of(page)}.items():
        assert path.read_text() == text, "python -m benchmarks.tables renews it"


@pytest.mark.parametrize("path", sorted((ROOT / "benchmarks" / "results").glob("*/correlations*.csv")), ids=str)
def test_committed_statistics_equal_recomputed_ones(path):
    measured, given = measures_for(path), read_rows(path)
    goals = {row["graph"]: float(row["goals"]) for row in measured}
    rows = first_seeds(read_rows(path.with_name("sweep.csv")), int(given[0]["seeds_max"]))
    milestone = path.stem.removeprefix("correlations").removeprefix("_")
    trained_by = {milestone: read_trained(rows, measured, milestone)} if milestone else by_rule(rows, measured)
    found = [(outcome, one) for outcome, several in trained_by.items() for one in several]
    assert {(outcome, one.method) for outcome, one in found} == {(row["outcome"], row["method"]) for row in given}
    for _, trained in found:
        measures = measures_of(trained.graphs, measured)
        now = correlations(medians(trained.outcomes), measures, np.array([goals[graph] for graph in trained.graphs]))
        own = [row for row in given if row["method"] == trained.method and row["measure"] in measures]
        assert len(own) == len(now)
        for row in own:
            value = now[row["measure"], row["statistic"]]
            assert float(row["value"] or "nan") == pytest.approx(value, rel=1e-5, abs=1e-9, nan_ok=True)
