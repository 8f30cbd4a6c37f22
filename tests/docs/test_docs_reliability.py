"""The page on reliability: the numbers of its table of mutants add up."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
ROW = re.compile(r"^\| (`[^|]+\.py`) \| (\d+) \| (\d+) \|[^|]*\| (\d+)", re.MULTILINE)
"""Modules, mutants, killed, (by new tests,) explained."""


def test_each_mutant_is_killed_or_explained():
    page = (ROOT / "docs" / "reliability.md").read_text()
    rows = ROW.findall(page)
    modules = [module for named, *_ in rows for module in re.findall(r"`([^`]+)`", named)]
    assert f"all mutants of {len(modules)} modules" in page
    for named, mutants, killed, explained in rows:
        assert int(mutants) == int(killed) + int(explained), named
    for module in modules:
        assert (ROOT / "hierroom" / module).is_file()
