"""The tables of sweeps in README and docs are those that their committed rows give."""

import sys
from pathlib import Path

import pytest

from hierroom.errors import InputError

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "benchmarks"))

import hindsight  # noqa: E402
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


def test_the_table_of_hindsight_is_what_its_rows_say(capsys):
    hindsight.main()
    lines = [line.strip() for line in capsys.readouterr().out.splitlines() if line.strip()]
    assert len(lines) == 2 + 4 * 3
    assert "\n" + "\n".join(lines) + "\n" in (ROOT / "docs" / "results.md").read_text()


def test_a_difference_is_that_of_the_same_seed():
    rows = [
        {"hindsight": arm, "graph": "d", "seed": seed, "length": value}
        for arm, seed, value in (("yes", "1", "5"), ("no", "0", "7"), ("no", "1", "1"), ("yes", "0", "3"))
    ]
    assert hindsight.differences(rows, "d", "length").tolist() == [4, -4]
