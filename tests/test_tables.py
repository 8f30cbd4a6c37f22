"""The tables of sweeps in README and docs are those that their committed rows give."""

import sys
from pathlib import Path

import pytest

from hierroom.errors import InputError

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "benchmarks"))

import tables  # noqa: E402


@pytest.mark.parametrize("page", tables.PAGES, ids=lambda page: page.name)
def test_each_table_is_that_of_its_rows(page, monkeypatch):
    monkeypatch.chdir(ROOT)
    assert tables.renewed(page.read_text()) == page.read_text(), "python benchmarks/tables.py renews it"


def test_a_table_is_put_in_its_place_and_an_unfinished_one_is_not(monkeypatch):
    text = "before\n<!-- sweep one -->\nold\n<!-- end of sweep -->\nafter\n<!-- sweep two -->\n<!-- end of sweep -->\n"
    monkeypatch.setattr(tables, "table", lambda name: f"| {name} |\n")
    assert tables.renewed(text) == (
        "before\n<!-- sweep one -->\n| one |\n<!-- end of sweep -->\nafter\n"
        "<!-- sweep two -->\n| two |\n<!-- end of sweep -->\n"
    )
    monkeypatch.undo()
    monkeypatch.chdir(ROOT)
    with pytest.raises(InputError, match="0 of 99 runs of the sweep ablation are done"):
        tables.table("ablation")
