"""The tables of sweeps in README and docs equal those of their committed rows."""

from pathlib import Path

import pytest

from benchmarks import tables

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
@pytest.mark.parametrize("page", tables.PAGES, ids=lambda page: page.name)
def test_tables_on_pages_equal_their_rows(page, monkeypatch):
    monkeypatch.chdir(ROOT)
    for path, text in {page: tables.renewed(page.read_text()), **tables.files_of(page)}.items():
        assert path.read_text() == text, "python -m benchmarks.tables renews it"
