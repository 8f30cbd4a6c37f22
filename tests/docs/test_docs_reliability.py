"""The page on reliability names the modules that `make mutate` tries, and its numbers add up."""

import re
from pathlib import Path

from mutation.targets import TARGETS, files_of_tests

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "reliability.md").read_text()
ROWS = re.findall(r"^\| (`[^|]+\.py`) \| (\d+) \| (\d+) \|[^|]*\| (\d+)", PAGE, re.MULTILINE)
"""Modules, mutants, killed, (by new tests,) explained."""


def test_each_mutant_is_killed_or_explained():
    for named, mutants, killed, explained in ROWS:
        assert int(mutants) == int(killed) + int(explained), named


def test_the_table_has_the_modules_that_are_mutated():
    explained = {module: int(number) for named, *_, number in ROWS for module in re.findall(r"`([^`]+)`", named)}
    assert explained == {path: number for path, _, number in TARGETS.values()}
    assert f"all mutants of {len(explained)} modules" in PAGE
    assert all((ROOT / "hierroom" / module).is_file() for module in explained)


def test_each_mutated_module_has_tests():
    assert all(len(files_of_tests(name)) == 1 for _, tests, _ in TARGETS.values() for name in tests.split())
