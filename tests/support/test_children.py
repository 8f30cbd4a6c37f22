"""Child processes of tests are started by `children`, with its limit."""

import re
from pathlib import Path

TESTS = Path(__file__).parents[1]
OWN_LIMIT = re.compile(r"subprocess\.(run|check_output|check_call)\(|\btimeout=[\d.]+[,)]|\.(wait|join)\([\d.]+\)")
"""Calls that wait for a child's end, and limits that are numbers."""


def test_no_test_sets_a_separate_time_limit():
    found = {path.name: OWN_LIMIT.findall(path.read_text()) for path in TESTS.rglob("*.py") if path != Path(__file__)}
    assert {name for name, calls in found.items() if calls} == {"children.py"}
