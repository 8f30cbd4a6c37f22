"""CONTRIBUTING.md names the modules that `make mutate` tries, and its numbers add up."""

import re
from pathlib import Path

from mutation.targets import TARGETS, files_of_tests

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "CONTRIBUTING.md").read_text()
FOUND = re.findall(r"`([\w/]+\.py)` (\d+) of (\d+)", PAGE)
"""Modules, the mutants that are killed, and all."""


def test_surviving_mutants_equal_those_of_the_targets():
    survivors = {path: number for path, _, number in TARGETS.values()}
    assert {module: int(mutants) - int(killed) for module, killed, mutants in FOUND} == survivors
    assert len(FOUND) == len(survivors)


def test_mutation_table_names_existing_modules():
    assert f"all mutants of {len(FOUND)} modules" in PAGE
    assert all((ROOT / "hierroom" / module).is_file() for module, *_ in FOUND)


def test_each_mutated_module_has_tests():
    assert all(len(files_of_tests(name)) == 1 for _, tests, _ in TARGETS.values() for name in tests.split())
