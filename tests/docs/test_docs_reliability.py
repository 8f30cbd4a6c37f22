"""CONTRIBUTING.md names the modules that `make mutate` tries, and its numbers add up."""

import re
from pathlib import Path

from mutation.targets import TARGETS, files_of_tests

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "CONTRIBUTING.md").read_text()
FOUND = re.findall(r"`([\w/]+\.py)` (\d+) of (\d+)", PAGE)
"""Modules, the mutants that are killed, and all."""


def test_each_mutant_is_killed_or_explained():
    survivors = {path: number for path, _, number in TARGETS.values()}
    assert {module: int(mutants) - int(killed) for module, killed, mutants in FOUND} == survivors
    assert len(FOUND) == len(survivors)


def test_the_table_has_the_modules_that_are_mutated():
    assert f"all mutants of {len(FOUND)} modules" in PAGE
    assert all((ROOT / "hierroom" / module).is_file() for module, *_ in FOUND)


def test_each_mutated_module_has_tests():
    assert all(len(files_of_tests(name)) == 1 for _, tests, _ in TARGETS.values() for name in tests.split())
