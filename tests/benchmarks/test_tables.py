"""The tables of sweeps in README and docs equal those of their committed rows, and plans of sweeps are valid."""

from pathlib import Path

import pytest

from benchmarks import tables
from hierroom.lab.sweep.plan import read_plan

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("page", tables.PAGES, ids=lambda page: page.name)
def test_tables_on_pages_equal_their_rows(page, monkeypatch):
    monkeypatch.chdir(ROOT)
    for path, text in {page: tables.renewed(page.read_text()), **tables.files_of(page)}.items():
        assert path.read_text() == text, "python -m benchmarks.tables renews it"


def test_every_benchmark_sweep_is_a_valid_plan(monkeypatch):
    monkeypatch.chdir(ROOT)
    plans = sorted((ROOT / "benchmarks" / "sweeps").glob("*.toml"))
    assert plans
    for path in plans:
        assert len(read_plan(path).runs()) >= 6, path
